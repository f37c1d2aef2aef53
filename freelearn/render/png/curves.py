"""Loads against pressure, and against each other, at one kinematic state."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from freelearn.measurements.states import pressure_direction
from freelearn.render.png.canvas import COLORS, finish, heading, new_figure

PRESSURE, FORCE, MOMENT = "pressure P [kPa]", "force F [N]", "moment M [N·mm]"
PANELS = (
    ("pressure_kpa", "force_n", "pressure_kpa", "force_pred_n", PRESSURE, FORCE),
    ("pressure_kpa", "moment_nmm", "pressure_kpa", "moment_pred_nmm", PRESSURE, MOMENT),
    ("force_n", "moment_nmm", "force_pred_n", "moment_pred_nmm", FORCE, MOMENT),
)
COLUMNS = ["pressure_kpa", "force_n", "moment_nmm"]
# Dashes are taken by extrapolation, so models differ by colour and by a few sparse marks. None of them is a square.
MARKS = ("", "o", "^", "D", "v", "P", "*")
MARKS_ON_A_CURVE = 6


def curves(
    measured: pd.DataFrame, models: Mapping[str, pd.DataFrame] | pd.DataFrame, title: str, simulated: bool
) -> Figure:
    """Three panels, F–P, M–P and F–M: measured rows as black squares (open where the pressure fell), models as lines.

    measured: measurement columns of one kinematic state, in time order; buckled rows are left out. models: by name
    (or one alone, then called "model"), frames of model_curve, drawn in their own order;
    the line is solid over the measured pressures and dashed beyond them.
    """
    named = {"model": models} if isinstance(models, pd.DataFrame) else models
    kept = (measured["buckled"] == 0).to_numpy()
    shown = measured[kept]
    # From all rows, buckled ones included: the direction is that of the step which led to the row.
    falling = pressure_direction(measured)[kept] < 0
    figure = new_figure(12.0, 4.3)
    figure.suptitle(heading(title, simulated))
    figure.subplots_adjust(left=0.065, right=0.985, bottom=0.225, top=0.89, wspace=0.27)
    for number, (x, y, model_x, model_y, x_label, y_label) in enumerate(PANELS, 1):
        axes = figure.add_subplot(1, 3, number)
        # Squares first in the legend, lines above nothing: a square hidden by its own model looks like a missing one.
        for rows, fill, label in ((~falling, "black", "measured, rising"), (falling, "white", "measured, falling")):
            if rows.any():
                axes.plot(shown[x][rows], shown[y][rows], "s", color="black", mfc=fill, ms=5, label=label, zorder=3)
        for (name, curve), color, mark in zip(named.items(), cycle(COLORS), cycle(MARKS), strict=False):
            _line(axes, curve, model_x, model_y, name, color, mark)
        finish(axes, x_label, y_label)
        axes.locator_params(nbins=6)
        if number == 1:
            if any(curve["extrapolated"].any() for curve in named.values()):
                axes.plot([], [], "--", color="grey", lw=1.2, label="beyond the measured pressures")
            # Below the panels: inside them every corner may hold data.
            handles, labels = axes.get_legend_handles_labels()
            figure.legend(handles, labels, loc="lower center", ncols=min(len(labels), 6), frameon=False, fontsize=9)
    return figure


def _line(axes: Axes, curve: pd.DataFrame, x: str, y: str, name: str, color: str, mark: str) -> None:
    """One model: solid with sparse marks where measured, dashed beyond; the two share the point between them."""
    across, up = curve[x].to_numpy(), curve[y].to_numpy()
    outside = curve["extrapolated"].to_numpy(dtype=bool)
    every = max(1, int((~outside).sum()) // MARKS_ON_A_CURVE)
    solid = np.where(outside, np.nan, across)
    axes.plot(solid, up, "-", color=color, lw=1.8, marker=mark, ms=6, mfc="white", markevery=every, label=name)
    for part in _stretches(outside):
        axes.plot(across[part], up[part], "--", color=color, lw=1.3)


def _stretches(outside: np.ndarray) -> list[slice]:
    """Each run of extrapolated points, widened by the neighbours inside that it joins on to, so no gap shows."""
    edges = np.flatnonzero(np.diff(np.r_[False, outside, False].astype(int)))
    return [slice(max(0, start - 1), stop + 1) for start, stop in zip(edges[::2], edges[1::2], strict=True)]


def curve_numbers(measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """What the three panels show, as one table: the column `what` says measured, or the model's name."""
    rows = measured.loc[measured["buckled"] == 0, COLUMNS].assign(what="measured")
    names = {"force_pred_n": "force_n", "moment_pred_nmm": "moment_nmm"}
    parts = [rows, *(curve.rename(columns=names).assign(what=name) for name, curve in curves.items())]
    return pd.concat(parts, ignore_index=True)[["what", *COLUMNS, "extrapolated"]] if curves else rows
