"""Model against measurement: error map over what is imposed, and curves at any kinematic state."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import panel as pn
import torch
from bokeh.models import Slider

from freelearn.measurements.beds import bed_of
from freelearn.measurements.sets import samples_of
from freelearn.measurements.states import States, kinematic_state
from freelearn.measurements.usable import usable_rows
from freelearn.models.base import Model
from freelearn.models.build import load_model
from freelearn.render.html.charts.curves import CurveCharts
from freelearn.render.html.charts.residuals import ResidualCharts, scales
from freelearn.results.curve import model_curve
from freelearn.results.curve_panels import panels_of
from freelearn.results.quantities import moving, plane, told
from freelearn.results.residuals import residual_table
from freelearn.results.states import ROWS_FOR_A_CURVE, fields, place_text, places, state_title
from freelearn.workbench.session import Session
from freelearn.workbench.tick import Tick
from freelearn.workbench.words import say, words

FIRST, NOW = "first fit", "this fit"
WIDTH, HEIGHT = 312, 290


class Fitted:
    """A finished run's rows, states and model."""

    def __init__(self, folder: Path) -> None:
        self.model: Model = load_model(folder / "checkpoint.ckpt")
        self.table = pd.read_csv(folder / "predictions.csv")
        self.states = States.from_table(self.table)
        self.state = kinematic_state(self.table)
        self.usable = usable_rows(self.table)
        self.residuals = residual_table(self.table)
        self.places = places(self.table)
        self.bed, self.told = bed_of(self.table), told(self.table)
        # Of a bed that held an elongation or a twist throughout, the map shows the pressure in its place.
        self.over = plane(self.table)
        self.map = residual_table(self.table, self.over)
        self.field = fields(self.table, self.over)[0]

    def curve(self, rows: np.ndarray) -> pd.DataFrame:
        """What the model predicts along the pressures of these rows (see results.curve.model_curve)."""
        return model_curve(self.model, self.states[torch.as_tensor(rows)], self.usable[rows])


@lru_cache(8)
def fitted(folder: Path, written: float) -> Fitted:
    """written: when the run was, so that a newer one in the same folder is read anew."""
    return Fitted(folder)


class Comparison:
    """The middle of the page."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.now: Fitted | None = None
        self.first: Fitted | None = None
        self.title = words()
        self.sample = pn.widgets.Select(name="sample", options=[], width=110)
        # Bokeh's own: Panel's waits 50 ms for more before it tells of a move.
        self.slider = Slider(start=0, end=1, step=1, value=0, show_value=False, title="kinematic state", width=560)
        self.labels: dict[int, str] = {}
        self.fixed = Tick("map colors as in the first fit", 220, lambda _: self._draw_map(), ticked=True)
        self.curves, self.maps = CurveCharts([FIRST, NOW], WIDTH, HEIGHT), ResidualCharts(WIDTH, HEIGHT, tap=True)
        self.curves_view, self.maps_view = pn.Row(), pn.Row()
        self._place_curves()
        self._place_maps()
        self.sample.param.watch(lambda _: self._sample_chosen(), "value")
        self.slider.on_change("value", lambda attr, old, new: self._draw_curves())
        self.view = pn.Column(
            self.title,
            pn.Row(self.sample, pn.pane.Bokeh(self.slider), self.fixed.view),
            self.curves_view,
        )

    def _place_curves(self) -> None:
        self.curves_view.objects = [pn.pane.Bokeh(panel) for panel in self.curves.panels]

    def _place_maps(self) -> None:
        """Beside the staircase, see Results."""
        self.maps.source.selected.on_change("indices", self._tapped)
        for panel in self.maps.panels:
            # The longest is that of an outer diameter.
            panel.title.text_font_size = "11px"
        self.maps_view.objects = [pn.pane.Bokeh(panel) for panel in self.maps.panels]

    def refresh(self) -> None:
        """Shows the latest run, and the first one that it can be compared with."""
        runs = self.session.comparable()
        self.first, self.now = self._fitted(runs[0]), self._fitted(runs[-1])
        if (self.maps.plane, tuple(self.maps.quantities)) != (self.now.over, self.now.told):
            self.maps = ResidualCharts(WIDTH, HEIGHT, True, self.now.over, self.now.told)
            self._place_maps()
        samples = [int(n) for n in np.unique(self.now.table["sample"])]
        self._title(runs[-1])
        if self.sample.options != samples:
            own = samples_of(runs[-1]["question"].train, self.now.table["sample"].to_numpy())
            self.sample.param.update(options=samples, value=int(own[0]))
        self._sample_chosen()

    def _fitted(self, run: dict[str, Any]) -> Fitted:
        folder = self.session.folder / run["folder"]
        return fitted(folder, (folder / "results.json").stat().st_mtime)

    def _title(self, run: dict[str, Any]) -> None:
        question = run["question"]
        about = self.session.read(run, "results.json") or {}
        source = "simulated data" if question.data != "csv" else f"measured data, {question.name}"
        effects = " + ".join(["", *question.effects])
        error = about.get("tests", {}).get(question.train, {}).get("E")
        text = f"{question.model}{effects}, fitted on {question.train} ({source})"
        say(self.title, [text + (f": test error E {100 * error:.3g} %" if error is not None else "")], "good")

    def _sample_chosen(self) -> None:
        assert self.now is not None
        places = self.now.places[self.now.places["sample"] == self.sample.value]
        rows = np.bincount(self.now.state[self.now.usable], minlength=len(self.now.places))
        places = places[rows[places.index] > 0].sort_values([quantity.column for quantity in self.now.bed.state])
        shown = self._state()
        self.labels = {int(n): place_text(place, self.now.bed.state) for n, place in places.iterrows()}
        self.slider.end = max(1, len(self.labels) - 1)
        if self.labels:
            self._move_to(shown if shown in self.labels else self._worst(list(self.labels)))
        self._draw_map()
        self._draw_curves()

    def _state(self) -> int | None:
        """The kinematic state that the slider is on."""
        states = list(self.labels)
        return states[min(int(self.slider.value), len(states) - 1)] if states else None

    def _move_to(self, state: int) -> None:
        self.slider.value = list(self.labels).index(state)

    def _worst(self, states: list[int]) -> int:
        assert self.now is not None
        part = self.now.residuals.iloc[states]
        part = part[part["rows"] >= min(ROWS_FOR_A_CURVE, part["rows"].max())]
        ends = scales(part, self.now.told)
        size = sum(part[q.column].abs().fillna(0) / end for q, end in zip(self.now.told, ends, strict=True))
        return int(part.index[int(np.argmax(size))])

    def _draw_map(self) -> None:
        if self.now is None or self.first is None:
            return
        of_sample = self.now.map["sample"] == self.sample.value
        first = self.first.map
        limits = scales(first[first["sample"] == self.sample.value], self.now.told) if self.fixed.ticked else None
        self.shown = np.flatnonzero(of_sample)
        self.maps.source.selected.indices = []
        self.maps.show(self.now.map[of_sample], limits)

    def _draw_curves(self) -> None:
        state = self._state()
        if self.now is None or self.first is None or state is None:
            return
        rows = np.flatnonzero(self.now.state == state)
        measured = self.now.table.iloc[rows]
        where = ", ".join(part for part in (self.labels[state], moving(measured)) if part)
        self.slider.title = f"kinematic state ({where})"
        curves = {NOW: self.now.curve(rows)}
        if self.first is not self.now:
            curves[FIRST] = self.first.curve(rows)
        shown = panels_of(measured)
        if tuple(self.curves.shown) != shown:
            self.curves = CurveCharts([FIRST, NOW], WIDTH, HEIGHT, shown)
            self._place_curves()
        self.curves.show(measured, curves)
        self.curves.panels[0].title.text = f"{shown[0].title}: {state_title(measured)}"

    def _tapped(self, attribute: str, old: list[int], new: list[int]) -> None:
        if not new or self.now is None:
            return
        inside = (self.now.field == self.shown[new[0]]) & self.now.usable
        states = [int(state) for state in self.now.state[inside] if state in self.labels]
        if states:
            # A field over a pressure has rows of several states: one with the most of them.
            self._move_to(max(states, key=states.count))
