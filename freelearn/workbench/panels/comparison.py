"""Model against measurement: error map over what is imposed, and curves at any kinematic state, drawn ahead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import Slider

from freelearn.common.display import COLORS
from freelearn.data.sets import samples_of
from freelearn.queries.curves.curve_panels import panels_of
from freelearn.queries.curves.shown_states import place_text
from freelearn.report.html.curve_charts import CurveCharts, Drawing
from freelearn.report.html.residual_charts import ResidualCharts, scales
from freelearn.workbench.panels.playback import Playback
from freelearn.workbench.panels.widgets import Tick, beside, share, steady, together, wide
from freelearn.workbench.state.fitted import Fitted, of_run
from freelearn.workbench.state.session import Session

# Drawings of the states that the slider has been on, and of those that it comes to next.

# Drawings made ahead of the slider, and how long after a move [ms]: what it has just asked for is on its way by then.
AHEAD, PAUSE = 2, 40
# Drawings kept, of some 100 kB each, in every tab.
KEPT = 40


class Ahead:
    """Makes drawings once, and the next ones while nobody waits. make: the drawing of a curve, by its number."""

    def __init__(self, make: Callable[[int], Drawing]) -> None:
        self.make = make
        self.kept: dict[int, Drawing] = {}
        self.next: Sequence[int] = ()
        self.waiting: Any = None

    def clear(self) -> None:
        """Forgets all of them: they would show something else now."""
        self.kept, self.next = {}, ()

    def drawing(self, curve: int) -> Drawing:
        """The drawing of a curve."""
        if curve not in self.kept:
            if len(self.kept) >= KEPT:
                del self.kept[next(iter(self.kept))]
            self.kept[curve] = self.make(curve)
        return self.kept[curve]

    def prefetch(self, curves: Sequence[int]) -> None:
        """Has the drawings of these curves made soon, the first ones of those that are missing."""
        self.next = curves[:AHEAD]
        document = pn.state.curdoc
        if document is not None and self.waiting is None and not set(self.next) <= set(self.kept):
            self.waiting = document.add_timeout_callback(self._make_one, PAUSE)

    def _make_one(self) -> None:
        self.waiting = None
        missing = [curve for curve in self.next if curve not in self.kept]
        if missing:
            self.drawing(missing[0])
            self.prefetch(self.next)


# Model against measurement: error map over what is imposed, and curves at any kinematic state.

FIRST, NOW = "first fit", "this fit"
WIDTH, HEIGHT = 312, 315
SMALL = "11px"


class Comparison:
    """The middle of the page: at which state, and how well the model does there and elsewhere."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.now: Fitted | None = None
        self.first: Fitted | None = None
        self.sample = pn.widgets.Select(name="sample", options=[], width=110)
        # Bokeh's own: Panel's waits 50 ms for more before it tells of a move.
        self.slider = Slider(start=0, end=1, step=1, value=0, show_value=False, title="kinematic state", width=560)
        self.labels: dict[int, str] = {}
        self.chosen: tuple[int, str] | None = None
        self.fixed = Tick("map colors as in the first fit", 220, lambda _: self._draw_map(), ticked=True)
        self.banded = Tick("95 % bands", 220, session.show_bands, ticked=session.banded)
        self.drawn_banded = session.banded
        self.curves, self.maps = CurveCharts([FIRST, NOW], WIDTH, HEIGHT), ResidualCharts(WIDTH, HEIGHT, tap=True)
        self.ahead = Ahead(self._drawing)
        # What each panel's legend names: of this sample all that was drawn, for each change of it is a layout anew.
        self.named: dict[int, set[str]] = {}
        self.curve_group, self.map_group = beside(), beside()
        self.playback = Playback(dict(zip((FIRST, NOW), COLORS, strict=False)))
        self.charts = together(self.curve_group, self.map_group)
        self.curve_panes, self.map_panes = list[pn.pane.Bokeh](), list[pn.pane.Bokeh]()
        self._place_curves()
        self._place_maps()
        self.sample.param.watch(lambda _: self._sample_chosen(), "value")
        self.slider.on_change("value", lambda attr, old, new: self._slid(old, new))
        self.slider.sizing_mode = "stretch_width"
        slid = pn.pane.Bokeh(self.slider, sizing_mode="stretch_width")
        self.view = pn.Column(
            pn.Row(self.sample, slid, pn.Column(self.fixed.view, self.banded.view), sizing_mode="stretch_width"),
            self.playback.view,
            self.charts,
            sizing_mode="stretch_width",
        )

    def _place_curves(self) -> None:
        # The first says at which state: two numbers with their units fit only when small.
        self.curves.panels[0].title.text_font_size = SMALL
        for panel in self.curves.panels:
            steady(panel)
        self.curve_panes = [wide(panel) for panel in self.curves.panels]
        share(self.curve_group, self.curve_panes)

    def _place_maps(self) -> None:
        self.maps.source.selected.on_change("indices", self._tapped)
        for panel in self.maps.panels:
            # The longest is that of an outer diameter.
            panel.title.text_font_size = SMALL
        self.map_panes = [wide(panel) for panel in self.maps.panels]
        share(self.map_group, self.map_panes)

    def refresh(self) -> None:
        """Shows the latest run, and the first one that it can be compared with."""
        runs = self.session.comparable()
        self.first, self.now = of_run(self.session, runs[0]), of_run(self.session, runs[-1])
        samples = [int(n) for n in np.unique(self.now.table["sample"])]
        if self.sample.options != samples:
            own = samples_of(runs[-1]["question"].train, self.now.table["sample"].to_numpy())
            self.sample.param.update(options=samples, value=int(own[0]))
        self._sample_chosen()

    def show_bands(self) -> None:
        """Shows the bands or hides them, as was chosen here or in another tab."""
        if self.banded.ticked != self.session.banded:
            self.banded.show(self.session.banded, visible=True, disabled=False)
        if self.drawn_banded != self.session.banded:
            self._forget()
            self._draw_curves()

    def _forget(self) -> None:
        """Of what was drawn nothing holds any more."""
        self.ahead.clear()
        self.named = {}

    def _sample_chosen(self) -> None:
        assert self.now is not None
        self._forget()
        before = self.chosen
        self.labels, sample = self.now.labels(self.sample.value), self.sample.value
        self.slider.end = max(1, len(self.labels) - 1)
        if self.labels:
            # The same place, not the same number: another run may have seen other states.
            same = [curve for curve, label in self.labels.items() if (sample, label) == before]
            self._move_to(same[0] if same else self.now.worst(list(self.labels)))
        self.chosen = self._chosen()
        self._draw_map()
        self._draw_curves()

    def _curve(self) -> int | None:
        """The curve that the slider is on."""
        curves = list(self.labels)
        return curves[min(int(self.slider.value), len(curves) - 1)] if curves else None

    def _chosen(self) -> tuple[int, str] | None:
        """The sample and the place that the slider is on."""
        curve = self._curve()
        return None if curve is None else (self.sample.value, self.labels[curve])

    def _move_to(self, curve: int) -> None:
        self.slider.value = list(self.labels).index(curve)

    def _draw_map(self) -> None:
        if self.now is None or self.first is None:
            return
        of_sample = self.now.map["sample"] == self.sample.value
        # Another sample may have been measured otherwise: no empty panel.
        told = self.now.told_of(self.sample.value)
        if (self.maps.plane, tuple(self.maps.quantities)) != (self.now.over, told):
            self.maps = ResidualCharts(WIDTH, HEIGHT, True, self.now.over, told)
            self._place_maps()
        first = self.first.map
        limits = scales(first[first["sample"] == self.sample.value], told) if self.fixed.ticked else None
        self.shown = np.flatnonzero(of_sample)
        self.maps.source.selected.indices = []
        self.maps.show(self.now.map[of_sample], limits)

    def _slid(self, old: int, new: int) -> None:
        # In one message: for each of its own the browser would draw everything anew.
        with pn.io.hold():
            self._draw_curves()
        self.chosen = self._chosen()
        curves = list(self.labels)
        if self.now is not None and not self.now.log:
            self.ahead.prefetch(curves[new + 1 :] if new > old else curves[:new][::-1])

    def _draw_curves(self) -> None:
        curve = self._curve()
        if self.now is None or curve is None:
            return
        self.slider.title = f"{'recording' if self.now.log else 'kinematic state'} ({self.labels[curve]})"
        self.playback.view.visible = self.now.log
        self.curve_group.visible = self.banded.view.visible = not self.now.log
        if self.now.log:
            # Along a recording a model is no function of the pressure.
            first = {} if self.first is self.now or self.first is None else {FIRST: self.first}
            self.playback.show({**first, NOW: self.now}, self.sample.value, self.now.rows(curve))
            return
        self.drawn_banded = self.session.banded
        shown = panels_of(self.now.table.iloc[self.now.rows(curve)])
        if tuple(self.curves.shown) != shown:
            self.curves = CurveCharts([FIRST, NOW], WIDTH, HEIGHT, shown)
            self._forget()
            self._place_curves()
        drawing = self.ahead.drawing(curve)
        for number, panel in enumerate(drawing.panels):
            self.named[number] = self.named.get(number, set()) | panel.entries
        self.curves.draw(drawing, self.named)
        place = place_text(self.now.place.loc[curve], self.now.bed.state).replace("-", "−")
        self.curves.panels[0].title.text = f"{shown[0].title}: sample {self.sample.value}, {place}"

    def _drawing(self, curve: int) -> Drawing:
        assert self.now is not None
        rows = self.now.rows(curve)
        curves = {NOW: self.now.predicted(rows, self.drawn_banded)}
        if self.first is not None and self.first is not self.now:
            curves[FIRST] = self.first.predicted(rows, self.drawn_banded, self.now)
        return self.curves.drawing(self.now.table.iloc[rows], curves)

    def _tapped(self, attribute: str, old: list[int], new: list[int]) -> None:
        if not new or self.now is None:
            return
        inside = (self.now.field == self.shown[new[0]]) & self.now.usable
        curves = [int(curve) for curve in self.now.curve[inside] if curve in self.labels]
        if curves:
            # A field over a pressure has rows of several curves: one with the most of them.
            self._move_to(max(curves, key=curves.count))
