"""Loads against pressure, and against each other, at one kinematic state."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from freelearn.plots.canvas import COLORS, LINES, finish, heading, new_figure

PRESSURE, FORCE, MOMENT = "pressure P [kPa]", "force F [N]", "moment M [N·mm]"


def curves(measured: pd.DataFrame, models: Mapping[str, pd.DataFrame], title: str, simulated: bool) -> Figure:
    """Three panels, F–P, M–P and F–M: measured rows as black squares (open where the pressure fell), models as lines.

    measured: measurement columns of one kinematic state; buckled rows are left out. models: by name, frames with
    pressure_kpa, force_pred_n, moment_pred_nmm and `extrapolated`; the line is solid over the measured pressures and
    dashed beyond them.
    """
    shown = measured[measured["buckled"] == 0]
    falling = measured["pressure_kpa"].diff().lt(0)[measured["buckled"] == 0].to_numpy()
    figure = new_figure(12.0, 4.0)
    figure.suptitle(heading(title, simulated))
    figure.subplots_adjust(left=0.06, right=0.985, bottom=0.15, top=0.86, wspace=0.27)
    panels = (
        ("pressure_kpa", "force_n", "pressure_kpa", "force_pred_n", PRESSURE, FORCE),
        ("pressure_kpa", "moment_nmm", "pressure_kpa", "moment_pred_nmm", PRESSURE, MOMENT),
        ("force_n", "moment_nmm", "force_pred_n", "moment_pred_nmm", FORCE, MOMENT),
    )
    for number, (x, y, model_x, model_y, x_label, y_label) in enumerate(panels, 1):
        axes = figure.add_subplot(1, 3, number)
        for (name, curve), color, style in zip(models.items(), COLORS, LINES, strict=False):
            inside = ~curve["extrapolated"].to_numpy()
            axes.plot(
                np.where(inside, curve[model_x], np.nan),
                curve[model_y],
                linestyle=style,
                color=color,
                lw=1.8,
                label=name,
            )
            for part in _outside(inside):
                axes.plot(curve[model_x].iloc[part], curve[model_y].iloc[part], "--", color=color, lw=1.2)
        for rows, fill, label in ((~falling, "black", "measured, rising"), (falling, "none", "measured, falling")):
            if rows.any():
                axes.plot(shown[x][rows], shown[y][rows], "s", color="black", mfc=fill, ms=5, label=label)
        finish(axes, x_label, y_label)
        if number == 1:
            axes.plot([], [], "--", color="grey", lw=1.2, label="beyond the measured pressures")
            axes.legend(frameon=False, fontsize=8)
    return figure


def _outside(inside: np.ndarray) -> list[slice]:
    """Stretches outside the measured range, each with the inside point it joins on to, so that no gap shows."""
    where = np.flatnonzero(inside)
    if not len(where):
        return [slice(0, len(inside))]
    return [slice(0, where[0] + 1), slice(where[-1], len(inside))]
