"""F–P, M–P and F–M at one kinematic state: measured rows and models."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, legend_below
from freelearn.render.palette import COLORS
from freelearn.results.curve_panels import (
    COLUMNS,
    PANELS,
    PRESSURE,
    SUSPECTED,
    apart,
    measured_points,
    suspected_points,
)
from freelearn.results.residuals import FORCE, MOMENT

DASHES = ("solid", "dotdash", "dotted")


class CurveCharts:
    """Three linked charts whose data can be exchanged. models: the names of the models drawn, in order."""

    def __init__(self, models: list[str], width: int = 400, height: int = 340) -> None:
        self.models = models
        empty: dict[str, list[float]] = {name: [] for name in (*COLUMNS, "fill", "direction", "across", "up")}
        # A row may slip in one of its loads alone: each panel draws others of them apart.
        self.rows = [ColumnDataSource(empty) for _ in PANELS]
        self.suspects = [ColumnDataSource(empty) for _ in PANELS]
        self.lines = {name: ColumnDataSource(_columns(None)) for name in models}
        self.panels = [self._panel(number, width, height) for number in range(len(PANELS))]

    def _panel(self, number: int, width: int, height: int) -> figure:
        about = PANELS[number]
        x, y = about.x, about.y
        panel = chart(about.title, x.label, y.label, width, height)
        for i, name in enumerate(self.models):
            color, dash = COLORS[i % len(COLORS)], DASHES[i % len(DASHES)]
            # Faint where the pressure was not measured.
            panel.line(x.predicted, y.predicted, source=self.lines[name], color=color, alpha=0.35, width=2)
            inside = f"{x.predicted}_in", f"{y.predicted}_in"
            line = panel.line(
                *inside, source=self.lines[name], color=color, width=2.5, line_dash=dash, legend_label=name
            )
            places = [(load.label, f"@{load.predicted}{{0.[000]}}") for load in (x, y)]
            hover(panel, [("model", name), *places], [line])
        marks = panel.scatter(
            x.column, y.column, source=self.rows[number], marker="square", size=7, line_color="black",
            fill_color="fill", legend_label="measured",
        )  # fmt: skip
        crosses = panel.scatter(
            "across", "up", source=self.suspects[number], marker="plus", angle=np.pi / 4, size=12, line_color="black",
            fill_color="white", legend_label=SUSPECTED,
        )  # fmt: skip
        places = [(load.label, f"@{load.column}{{0.[000]}}") for load in (x, y)]
        hover(panel, [("measured", "@direction"), *places], [marks])
        hover(panel, [(SUSPECTED, "@direction"), *places], [crosses])
        legend_below(panel)
        return panel

    def show(self, measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> None:
        """measured: one state's rows in time order; buckled and left-out ones are not drawn, suspected readings (see
        suspects.flagged) apart. curves: frames of model_curve."""
        points = measured_points(measured)
        for about, panel, rows, suspects in zip(PANELS, self.panels, self.rows, self.suspects, strict=True):
            crosses = suspected_points(points, curves, about)
            rows.data = _marked(points[~apart(points, about)])
            suspects.data = _marked(crosses)
            shown = {"measured", *curves, *([SUSPECTED] if len(crosses) else [])}
            for item in panel.legend[0].items:
                item.visible = item.label.value in shown
        for name in self.models:
            self.lines[name].data = _columns(curves.get(name))


def _marked(points: pd.DataFrame) -> dict[str, np.ndarray]:
    """Measured points with what their marks look like; across, up: where those are drawn that are drawn apart."""
    falling = points["falling"].to_numpy(dtype=bool)
    names = [*COLUMNS, *(name for name in ("across", "up") if name in points)]
    return {name: points[name].to_numpy(dtype=np.float64) for name in names} | {
        "fill": np.where(falling, "white", "black"),
        "direction": np.where(falling, "falling", "rising"),
    }


def _columns(curve: pd.DataFrame | None) -> dict[str, np.ndarray]:
    """A line's columns; `…_in` is blank beyond the measured pressures."""
    names = [load.predicted for load in (PRESSURE, FORCE, MOMENT)]
    if curve is None:
        return {f"{name}{end}": np.array([]) for name in names for end in ("", "_in")}
    outside = curve["extrapolated"].to_numpy(dtype=bool)
    columns = {name: curve[name].to_numpy(dtype=np.float64) for name in names}
    return columns | {f"{name}_in": np.where(outside, np.nan, values) for name, values in columns.items()}
