"""F–P, M–P and F–M, or curves of what else is measured, at one kinematic state: measured rows and models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, legend_below
from freelearn.render.palette import COLORS
from freelearn.results.curve_panels import (
    LOOSE,
    PANELS,
    SUSPECTED,
    CurvePanel,
    loose,
    measured_points,
    read,
    suspected_points,
)

# In legends: filled squares, and open ones.
MEASURED, FALLING = "measured", "falling pressure"
DASHES = ("solid", "dotdash", "dotted")


class CurveCharts:
    """Linked charts whose data can be exchanged. models: the names of the models drawn, in order. shown: the panels,
    see results.curve_panels."""

    def __init__(
        self, models: list[str], width: int = 400, height: int = 340, shown: Sequence[CurvePanel] = PANELS
    ) -> None:
        self.models, self.shown = models, shown
        self.columns = list(dict.fromkeys(q.column for panel in shown for q in (panel.x, panel.y)))
        empty: dict[str, list[float]] = {name: [] for name in (*self.columns, "direction", "across", "up")}
        # A row may slip in one of its readings alone: each panel draws others of them apart.
        self.rows, self.fallen, self.slack, self.suspects = ([ColumnDataSource(empty) for _ in shown] for _ in range(4))
        self.lines = {name: ColumnDataSource(self._columns(None)) for name in models}
        self.panels = [self._panel(number, width, height) for number in range(len(shown))]

    def _panel(self, number: int, width: int, height: int) -> figure:
        about = self.shown[number]
        x, y = about.x, about.y
        across, up = about.line
        panel = chart(about.title, x.label, y.label, width, height)
        for i, name in enumerate(self.models):
            color, dash = COLORS[i % len(COLORS)], DASHES[i % len(DASHES)]
            # Faint where the pressure was not measured.
            panel.line(across, up, source=self.lines[name], color=color, alpha=0.35, width=2)
            inside = f"{across}_in", f"{up}_in"
            line = panel.line(
                *inside, source=self.lines[name], color=color, width=2.5, line_dash=dash, legend_label=name
            )
            places = [(q.label, f"@{column}{{0.[000]}}") for q, column in zip((x, y), about.line, strict=True)]
            hover(panel, [("model", name), *places], [line])
        squares = [
            panel.scatter(
                x.column, y.column, source=rows[number], marker="square", size=7, line_color="black", fill_color=fill,
                legend_label=label,
            )
            for rows, fill, label in ((self.rows, "black", MEASURED), (self.fallen, "white", FALLING))
        ]  # fmt: skip
        hanging = panel.scatter(
            x.column, y.column, source=self.slack[number], marker="diamond", size=10, line_color="#666666",
            fill_color="white", legend_label=LOOSE,
        )  # fmt: skip
        crosses = panel.scatter(
            "across", "up", source=self.suspects[number], marker="plus", angle=np.pi / 4, size=12, line_color="black",
            fill_color="white", legend_label=SUSPECTED,
        )  # fmt: skip
        places = [(load.label, f"@{load.column}{{0.[000]}}") for load in (x, y)]
        hover(panel, [(MEASURED, "@direction"), *places], squares)
        hover(panel, [(LOOSE, "@direction"), *places], [hanging])
        hover(panel, [(SUSPECTED, "@direction"), *places], [crosses])
        legend_below(panel)
        return panel

    def show(self, measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> None:
        """measured: one state's rows in time order; buckled and left-out ones are not drawn, those in which the tube
        hangs loose and suspected readings (see suspects.flagged) apart. curves: frames of model_curve."""
        points = measured_points(measured)
        for number, (about, panel) in enumerate(zip(self.shown, self.panels, strict=True)):
            crosses, hanging = suspected_points(points, curves, about), points[loose(points, about)]
            shown = read(points, about)
            fallen = shown & points["falling"].to_numpy(dtype=bool)
            self.rows[number].data = _marked(points[shown & ~fallen], self.columns)
            self.fallen[number].data = _marked(points[fallen], self.columns)
            self.slack[number].data = _marked(hanging, self.columns)
            self.suspects[number].data = _marked(crosses, self.columns)
            named = {FALLING: fallen.any(), SUSPECTED: len(crosses), LOOSE: len(hanging)}
            named[MEASURED] = (shown & ~fallen).any()
            entries = {*curves, *(name for name, some in named.items() if some)}
            legend = panel.legend[0]
            for item in legend.items:
                item.visible = item.label.value in entries
            # More of them in a row would run out of a small chart.
            legend.ncols = "auto" if len(entries) < 4 else 3 if len(entries) == 4 else 2
        for name in self.models:
            self.lines[name].data = self._columns(curves.get(name))

    def _columns(self, curve: pd.DataFrame | None) -> dict[str, np.ndarray]:
        """A line's columns; `…_in` is blank beyond the measured pressures."""
        names = dict.fromkeys(column for panel in self.shown for column in panel.line)
        if curve is None:
            return {f"{name}{end}": np.array([]) for name in names for end in ("", "_in")}
        outside = curve["extrapolated"].to_numpy(dtype=bool)
        columns = {name: curve[name].to_numpy(dtype=np.float64) for name in names}
        return columns | {f"{name}_in": np.where(outside, np.nan, values) for name, values in columns.items()}


def _marked(points: pd.DataFrame, columns: Sequence[str]) -> dict[str, np.ndarray]:
    """Measured points with what their marks look like; across, up: where those are drawn that are drawn apart."""
    falling = points["falling"].to_numpy(dtype=bool)
    names = [*columns, *(name for name in ("across", "up") if name in points)]
    return {name: points[name].to_numpy(dtype=np.float64) for name in names} | {
        "direction": np.where(falling, "falling", "rising"),
    }
