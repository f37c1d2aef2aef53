"""F–P, M–P and F–M at one kinematic state: measured rows and models."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

from freelearn.measurements.states import pressure_direction
from freelearn.render.html.charts.canvas import COLORS, chart, hover, legend_below
from freelearn.render.png.curves import COLUMNS, PANELS

NAMES = ("F–P", "M–P", "F–M")
DASHES = ("solid", "dotdash", "dotted")


class CurveCharts:
    """Three linked charts whose data can be exchanged. models: the names of the models drawn, in order."""

    def __init__(self, models: list[str], width: int = 400, height: int = 340) -> None:
        self.models = models
        empty: dict[str, list] = {name: [] for name in (*COLUMNS, "fill", "direction")}
        self.rows = ColumnDataSource(empty)
        self.lines = {name: ColumnDataSource(_columns(None)) for name in models}
        self.panels = [self._panel(number, width, height) for number in range(3)]

    def _panel(self, number: int, width: int, height: int) -> figure:
        x, y, model_x, model_y, x_label, y_label = PANELS[number]
        panel = chart(NAMES[number], x_label, y_label, width, height)
        for i, name in enumerate(self.models):
            color, dash = COLORS[i % len(COLORS)], DASHES[i % len(DASHES)]
            # Faint where the pressure was not measured.
            panel.line(model_x, model_y, source=self.lines[name], color=color, alpha=0.35, width=2)
            inside = f"{model_x}_in", f"{model_y}_in"
            line = panel.line(
                *inside, source=self.lines[name], color=color, width=2.5, line_dash=dash, legend_label=name
            )
            tips = [("model", name), (x_label, f"@{model_x}{{0.[000]}}"), (y_label, f"@{model_y}{{0.[000]}}")]
            hover(panel, tips, [line])
        marks = panel.scatter(
            x,
            y,
            source=self.rows,
            marker="square",
            size=7,
            line_color="black",
            fill_color="fill",
            legend_label="measured",
        )
        tips = [("measured", "@direction"), (x_label, f"@{x}{{0.[000]}}"), (y_label, f"@{y}{{0.[000]}}")]
        hover(panel, tips, [marks])
        legend_below(panel)
        return panel

    def show(self, measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> None:
        """measured: one state's rows in time order, buckled ones left out here; curves: frames of model_curve."""
        kept = (measured["buckled"] == 0).to_numpy()
        falling = pressure_direction(measured)[kept] < 0
        rows = {name: measured[name].to_numpy(dtype=np.float64)[kept] for name in COLUMNS}
        rows["fill"] = np.where(falling, "white", "black")
        rows["direction"] = np.where(falling, "falling", "rising")
        self.rows.data = rows
        for panel in self.panels:
            for item in panel.legend[0].items:
                item.visible = item.label.value not in self.models or item.label.value in curves
        for name in self.models:
            self.lines[name].data = _columns(curves.get(name))


def _columns(curve: pd.DataFrame | None) -> dict[str, np.ndarray]:
    """A line's columns; `…_in` is blank beyond the measured pressures."""
    names = ("pressure_kpa", "force_pred_n", "moment_pred_nmm")
    if curve is None:
        return {f"{name}{end}": np.array([]) for name in names for end in ("", "_in")}
    outside = curve["extrapolated"].to_numpy(dtype=bool)
    columns = {name: curve[name].to_numpy(dtype=np.float64) for name in names}
    return columns | {f"{name}_in": np.where(outside, np.nan, values) for name, values in columns.items()}
