"""F–P, M–P and F–M, or curves of what else is measured, at one kinematic state: measured rows and models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from bokeh.models import ColumnDataSource, GlyphRenderer
from bokeh.plotting import figure

from freelearn.common.display import COLORS
from freelearn.queries.curves.curve_panels import (
    LOOSE,
    PANELS,
    SUSPECTED,
    CurvePanel,
    loose,
    measured_points,
    read,
    suspected_points,
)
from freelearn.queries.curves.model_curves import SHORT, strip
from freelearn.report.html.chart_canvas import chart, hover, still_legend

# In legends: filled squares, and open ones.
MEASURED, FALLING = "measured", "falling pressure"
DASHES = ("solid", "dotdash", "dotted")
# From this width on a chart has room for three entries of the legend beside each other [px].
WIDE = 400

# Of a data source, by name. Lists: Bokeh sends each array to a page in two messages of its own.
Columns = dict[str, list[Any]]


@dataclass(frozen=True)
class DrawnPanel:
    """The columns of what one panel shows of a state, bands by model, and its legend's entries."""

    rows: Columns
    fallen: Columns
    slack: Columns
    suspects: Columns
    bands: dict[str, Columns]
    entries: set[str]


@dataclass(frozen=True)
class Drawing:
    """What the charts show of a state. lines: columns of each model's curve."""

    panels: list[DrawnPanel]
    lines: dict[str, Columns]


class CurveCharts:
    """Linked charts whose data can be exchanged. models: the names of the models drawn, in order. shown: the panels,
    see curve_panels."""

    def __init__(
        self, models: list[str], width: int = 400, height: int = 340, shown: Sequence[CurvePanel] = PANELS
    ) -> None:
        self.models, self.shown = models, shown
        self.columns = list(dict.fromkeys(q.column for panel in shown for q in (panel.x, panel.y)))
        empty: dict[str, list[float]] = {name: [] for name in (*self.columns, "direction", "across", "up")}
        # A row may slip in one of its readings alone: each panel draws others of them apart.
        self.rows, self.fallen, self.slack, self.suspects = ([ColumnDataSource(empty) for _ in shown] for _ in range(4))
        self.lines = {name: ColumnDataSource(self._columns(None)) for name in models}
        # Of each panel with room for bands, one for each model.
        area: dict[str, list[float]] = {"across": [], "one": [], "other": []}
        self.bands = [{name: ColumnDataSource(area) for name in models if panel.banded} for panel in shown]
        self.panels = [self._panel(number, width, height) for number in range(len(shown))]

    def _panel(self, number: int, width: int, height: int) -> figure:
        about = self.shown[number]
        x, y = about.x, about.y
        across, up = about.line
        panel = chart(about.title, x.label, y.label, width, height)
        colors = dict(zip(self.models, cycle(COLORS), strict=False))
        # First, so that they lie below every line.
        bands = [
            panel.varea("across", "one", "other", source=source, fill_color=colors[name], fill_alpha=0.18)
            for name, source in self.bands[number].items()
        ]
        entries: dict[str, list[GlyphRenderer]] = {}
        for i, name in enumerate(self.models):
            color, dash = colors[name], DASHES[i % len(DASHES)]
            # Faint where the pressure was not measured.
            panel.line(across, up, source=self.lines[name], color=color, alpha=0.35, width=2)
            inside = f"{across}_in", f"{up}_in"
            line = panel.line(*inside, source=self.lines[name], color=color, width=2.5, line_dash=dash)
            entries[name] = [line]
            places = [(q.label, f"@{column}{{0.[000]}}") for q, column in zip((x, y), about.line, strict=True)]
            hover(panel, [("model", name), *places], [line])
        squares = [
            panel.scatter(
                x.column, y.column, source=rows[number], marker="square", size=7, line_color="black", fill_color=fill
            )
            for rows, fill in ((self.rows, "black"), (self.fallen, "white"))
        ]  # fmt: skip
        hanging = panel.scatter(
            x.column, y.column, source=self.slack[number], marker="diamond", size=10, line_color="#666666",
            fill_color="white",
        )  # fmt: skip
        crosses = panel.scatter(
            "across", "up", source=self.suspects[number], marker="plus", angle=np.pi / 4, size=12, line_color="black",
            fill_color="white",
        )  # fmt: skip
        places = [(load.label, f"@{load.column}{{0.[000]}}") for load in (x, y)]
        hover(panel, [(MEASURED, "@direction"), *places], squares)
        hover(panel, [(LOOSE, "@direction"), *places], [hanging])
        hover(panel, [(SUSPECTED, "@direction"), *places], [crosses])
        entries |= {MEASURED: squares[:1], FALLING: squares[1:], LOOSE: [hanging], SUSPECTED: [crosses]}
        still_legend(panel, entries | ({SHORT: bands} if bands else {}))
        return panel

    def show(self, measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> None:
        """Draws one state's rows and models, see `drawing`."""
        self.draw(self.drawing(measured, curves))

    def drawing(self, measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> Drawing:
        """What is drawn of one state, worked out.

        measured: one state's rows in time order; buckled and left-out ones are not drawn, those in which the tube hangs
        loose and suspected readings (see suspects.flagged) apart. curves: frames of model_curve, with the bands that
        are drawn."""
        points = measured_points(measured)
        panels = [self._drawn(about, points, curves) for about in self.shown]
        return Drawing(panels, {name: self._columns(curves.get(name)) for name in self.models})

    def draw(self, drawing: Drawing, also: Mapping[int, set[str]] = MappingProxyType({})) -> None:
        """Exchanges what is drawn. also: what legends name besides, by the panel's place."""
        for number, (drawn, panel) in enumerate(zip(drawing.panels, self.panels, strict=True)):
            _give(self.rows[number], drawn.rows)
            _give(self.fallen[number], drawn.fallen)
            _give(self.slack[number], drawn.slack)
            _give(self.suspects[number], drawn.suspects)
            for name, source in self.bands[number].items():
                source.data = drawn.bands[name]
            legend, entries = panel.legend[0], drawn.entries | also.get(number, set())
            for item in legend.items:
                item.visible = item.label.value in entries
            # More of them in a row would run out of a small chart; four fill two rows of two.
            count = len(entries)
            legend.ncols = "auto" if count < 4 else 3 if count > 4 and panel.width >= WIDE else 2
        for name, columns in drawing.lines.items():
            self.lines[name].data = columns

    def _drawn(self, about: CurvePanel, points: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> DrawnPanel:
        crosses, hanging = suspected_points(points, curves, about), points[loose(points, about)]
        shown = read(points, about)
        fallen = shown & points["falling"].to_numpy(dtype=bool)
        areas = {
            name: strip(curves[name], *about.line) if name in curves else np.empty((0, 3))
            for name in (self.models if about.banded else ())
        }
        some = {FALLING: fallen.any(), SUSPECTED: len(crosses), LOOSE: len(hanging)}
        some |= {MEASURED: (shown & ~fallen).any(), SHORT: any(map(len, areas.values()))}
        return DrawnPanel(
            _marked(points[shown & ~fallen], self.columns),
            _marked(points[fallen], self.columns),
            _marked(hanging, self.columns),
            _marked(crosses, self.columns),
            {name: dict(zip(("across", "one", "other"), area.T.tolist(), strict=True)) for name, area in areas.items()},
            {*curves, *(name for name, there in some.items() if there)},
        )

    def _columns(self, curve: pd.DataFrame | None) -> Columns:
        """A line's columns; `…_in` is blank beyond the measured pressures."""
        names = dict.fromkeys(column for panel in self.shown for column in panel.line)
        if curve is None:
            return {f"{name}{end}": [] for name in names for end in ("", "_in")}
        outside = curve["extrapolated"].to_numpy(dtype=bool)
        columns = {name: curve[name].to_numpy(dtype=np.float64) for name in names}
        columns |= {f"{name}_in": np.where(outside, np.nan, values) for name, values in columns.items()}
        return {name: values.tolist() for name, values in columns.items()}


def _marked(points: pd.DataFrame, columns: Sequence[str]) -> Columns:
    """Measured points with what their marks look like; across, up: where those are drawn that are drawn apart."""
    falling = points["falling"].to_numpy(dtype=bool)
    names = [*columns, *(name for name in ("across", "up") if name in points)]
    return {name: points[name].to_numpy(dtype=np.float64).tolist() for name in names} | {
        "direction": np.where(falling, "falling", "rising").tolist(),
    }


def _give(source: ColumnDataSource, columns: Columns) -> None:
    """Exchanges the points; a chart without any that gets none is not drawn anew."""
    if len(columns["direction"]) or len(source.data["direction"]):
        source.data = columns
