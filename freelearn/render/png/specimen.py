"""Nominal stress against stretch: measured, and what two rubbers fitted alike say."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import torch
from matplotlib.figure import Figure

from freelearn.fit.rubber import RubberFit
from freelearn.mechanics.mode import MPA
from freelearn.render.png.canvas import COLORS, finish, new_figure

POINTS = 200
MARKS = ("", "o", "^", "D")


def curve_table(table: pd.DataFrame, fits: Mapping[str, RubberFit]) -> pd.DataFrame:
    """The rows measured (source "measured") and each fit's curve over its mode's stretches (source: the fit's name).

    Columns: source, mode, specimen, stretch, stress_mpa, fitted (whether the mode was).
    """
    modes = next(iter(fits.values())).modes
    rows = [table.assign(source="measured", fitted=table["mode"].map({m: e.fitted for m, e in modes.items()}))]
    for name, found in fits.items():
        values = {n: torch.tensor(v, dtype=torch.float64) for n, v in found.values.items()}
        for mode, error in found.modes.items():
            own = table.loc[table["mode"] == mode, "stretch"]
            stretch = np.linspace(min(1.0, own.min()), max(1.0, own.max()), POINTS)
            stress = found.rubber.stress(values, mode, torch.tensor(stretch)).numpy() / MPA
            curve = {"source": name, "mode": mode, "specimen": "", "stretch": stretch, "stress_mpa": stress}
            rows.append(pd.DataFrame({**curve, "fitted": error.fitted}))
    return pd.concat(rows, ignore_index=True)[["source", "mode", "specimen", "stretch", "stress_mpa", "fitted"]]


def specimen_curves(curves: pd.DataFrame, fits: Mapping[str, RubberFit]) -> Figure:
    """One panel for each mode: measured rows as black squares, fits as lines, dashed where the mode was held out."""
    modes = next(iter(fits.values())).modes
    figure = new_figure(4.3 * len(modes), 4.4)
    width = 4.3 * len(modes)
    figure.subplots_adjust(left=0.8 / width, right=1 - 0.15 / width, bottom=0.22, top=0.9, wspace=0.25)
    for number, (mode, about) in enumerate(modes.items(), 1):
        axes = figure.add_subplot(1, len(modes), number)
        here = curves[curves["mode"] == mode]
        measured = here[here["source"] == "measured"]
        axes.plot(measured["stretch"], measured["stress_mpa"], "s", color="black", ms=4.5, label="measured", zorder=1)
        for (name, found), color, mark in zip(fits.items(), COLORS, MARKS, strict=False):
            line = here[here["source"] == name]
            style = "-" if found.modes[mode].fitted else "--"
            axes.plot(line["stretch"], line["stress_mpa"], style, color=color, lw=1.8, marker=mark, ms=5, mfc="white")
            axes.lines[-1].set(markevery=POINTS // 8, label=name)
        errors = " → ".join(f"{100 * found.modes[mode].error:.1f}" for found in fits.values())
        axes.set_title(f"{mode.replace('_', ' ')}, {'fitted' if about.fitted else 'held out'}: E = {errors} %", size=10)
        finish(axes, "stretch λ [–]", "nominal stress P [MPa]")
    # In the order of the legend of the first panel; the dashes are explained only where there are some.
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if not all(about.fitted for about in modes.values()):
        handles += figure.axes[0].plot([], [], "--", color="grey", lw=1.4)
        labels.append("mode held out of the fit")
    figure.legend(handles, labels, loc="lower center", ncols=2 if len(modes) == 1 else 4, frameon=False, fontsize=9)
    return figure
