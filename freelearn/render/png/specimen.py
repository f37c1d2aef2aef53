"""Nominal stress against stretch: measured, and what two rubbers fitted alike say."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from freelearn.fit.rubber import RubberFit
from freelearn.render.palette import COLORS
from freelearn.render.png.canvas import finish, new_figure
from freelearn.results.formats import percent
from freelearn.results.specimen_curves import POINTS

MARKS = ("", "o", "^", "D")


def specimen_curves(curves: pd.DataFrame, fits: Mapping[str, RubberFit]) -> Figure:
    """One panel for each mode: measured rows as black squares, fits as lines, dashed where the mode was held out.

    curves: of results.specimen_curves.curve_table, of the same fits."""
    modes = next(iter(fits.values())).modes
    figure = new_figure(4.3 * len(modes), 4.4)
    width = 4.3 * len(modes)
    figure.subplots_adjust(left=0.8 / width, right=1 - 0.15 / width, bottom=0.22, top=0.9, wspace=0.25)
    for number, (mode, about) in enumerate(modes.items(), 1):
        axes = figure.add_subplot(1, len(modes), number)
        here = curves[curves["mode"] == mode]
        measured = here[here["source"] == "measured"]
        axes.plot(measured["stretch"], measured["stress_mpa"], "s", color="black", ms=4.5, label="measured", zorder=1)
        for (name, fit), color, mark in zip(fits.items(), COLORS, MARKS, strict=False):
            line = here[here["source"] == name]
            style = "-" if fit.modes[mode].fitted else "--"
            axes.plot(line["stretch"], line["stress_mpa"], style, color=color, lw=1.8, marker=mark, ms=5, mfc="white")
            axes.lines[-1].set(markevery=POINTS // 8, label=name)
        errors = " → ".join(percent(fit.modes[mode].error, 1) for fit in fits.values())
        axes.set_title(f"{mode.replace('_', ' ')}, {'fitted' if about.fitted else 'held out'}: E = {errors} %", size=10)
        finish(axes, "stretch λ [–]", "nominal stress P [MPa]")
    # In the order of the legend of the first panel; the dashes are explained only where there are some.
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if not all(about.fitted for about in modes.values()):
        handles += figure.axes[0].plot([], [], "--", color="gray", lw=1.4)
        labels.append("mode held out of the fit")
    figure.legend(handles, labels, loc="lower center", ncols=2 if len(modes) == 1 else 4, frameon=False, fontsize=9)
    return figure
