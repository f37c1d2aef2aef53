"""Nominal stress against stretch: measured, and what two rubbers fitted alike say; of recordings over
the logarithm of time, too."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from freelearn.common.display import COLORS
from freelearn.common.formats import percent
from freelearn.data.specimen_schema import MODES, SHEAR, shear_of_stretch
from freelearn.data.specimen_tests import TIME, names_of, timed
from freelearn.fitting.rubber_fit import RubberFit
from freelearn.report.plots.canvas import finish, new_figure

# Marks belong to what was measured, dashes to what was held out: the later of two fits is the thinner line.
WIDTHS = (3.0, 1.5, 1.0, 0.7)
PANEL = 4.3  # inches
STRESSES = {"stress_mpa": "nominal stress P [MPa]", "stress_2_mpa": "nominal stress across, P₂ [MPa]"}


def specimen_curves(curves: pd.DataFrame, fits: Mapping[str, RubberFit]) -> Figure:
    """One panel for each mode and direction: measured stresses as black squares, fits as lines, dashed if held out; of
    recordings two, over the stretch and over time.

    curves: of specimen_tables.curve_table, of the same fits."""
    modes = next(iter(fits.values())).modes
    still = curves[~timed(curves)]
    by_mode = {mode: still[still["mode"] == mode] for mode in modes if mode in MODES}
    panels = [(mode, column) for mode, own in by_mode.items() for column in STRESSES if own[column].notna().any()]
    recorded = [
        (mode, column, own)
        for mode in MODES
        for column in STRESSES
        if (own := list(traces(curves, mode, column, fits)))
    ]
    count = len(panels) + 2 * len(recorded)
    width = PANEL * count
    figure = new_figure(width, 4.4)
    bottom = 0.22 if panels else 0.12
    figure.subplots_adjust(left=0.8 / width, right=1 - 0.15 / width, bottom=bottom, top=0.9, wspace=0.25)
    for number, (mode, column) in enumerate(panels, 1):
        axes = figure.add_subplot(1, count, number)
        _draw(axes, by_mode[mode], column, fits, mode)
        errors = " → ".join(percent(fit.modes[mode].error, 1) for fit in fits.values())
        fitted = "fitted" if modes[mode].fitted else "held out"
        axes.set_title(f"{mode.replace('_', ' ')}, {fitted}: E = {errors} %", size=10)
        finish(axes, "stretch λ [–]", STRESSES[column])
    for number, (mode, column, own) in enumerate(recorded):
        place = len(panels) + 2 * number + 1
        both = figure.add_subplot(1, count, place), figure.add_subplot(1, count, place + 1)
        draw_recordings(*both, own, mode, STRESSES[column])
        both[0].set_title(f"{mode.replace('_', ' ')}, recorded: dots measured, lines fitted", size=10)
    if not panels:
        return figure
    # In the order of the legend of the first panel; the dashes are explained only where there are some.
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if not all(modes[mode].fitted for mode in by_mode):
        handles += figure.axes[0].plot([], [], "--", color="gray", lw=1.4)
        labels.append("mode held out of the fit")
    columns = 2 if len(panels) == 1 else 4
    figure.legend(handles, labels, loc="lower center", ncols=columns, frameon=False, fontsize=9)
    return figure


def _draw(axes: Axes, curves: pd.DataFrame, column: str, fits: Mapping[str, RubberFit], mode: str) -> None:
    """One mode's stresses in one direction; where fits follow several specimens, each has its line and its name."""
    measured = curves[curves["source"] == "measured"]
    axes.plot(measured["stretch"], measured[column], "s", color="black", ms=4.5, label="measured", zorder=1)
    for (name, fit), color, width in zip(fits.items(), COLORS, WIDTHS, strict=False):
        style = "-" if fit.modes[mode].fitted else "--"
        lines = [line for _, line in curves[curves["source"] == name].groupby("specimen", sort=False)]
        for number, line in enumerate(lines):
            # Matplotlib leaves labels that begin with _ out of the legend.
            label = f"_{name}" if number else name
            axes.plot(line["stretch"], line[column], style, color=color, lw=width, label=label)
    if len(lines) > 1:
        axes.margins(x=0.15)
        for line in lines:
            end = line.iloc[-1]
            axes.annotate(end["specimen"], (end["stretch"], end[column]), (5, -2), textcoords="offset points", size=7)


# Recordings that a legend still names.
NAMED = 10


@dataclass(frozen=True)
class Trace:
    """One recording's samples as they are drawn: x the stretch, or the amount of shear; since its begin, s."""

    name: str
    x: np.ndarray
    since: np.ndarray
    measured: np.ndarray
    expected: np.ndarray
    fitted: bool


def traces(curves: pd.DataFrame, mode: str, column: str, fits: Mapping[str, RubberFit]) -> Iterator[Trace]:
    """Of the recordings of a mode, with what the last of the fits says of them. curves: of curve_table."""
    rows = curves[timed(curves) & (curves["mode"] == mode).to_numpy()]
    names = names_of(rows)
    last, fit = list(fits.items())[-1]
    for name in dict.fromkeys(names):
        own = rows[names == name]
        found, expected = own[own["source"] == "measured"], own[own["source"] == last]
        if found[column].isna().all():
            continue
        stretch = found["stretch"].to_numpy()
        x = shear_of_stretch(stretch) if mode == SHEAR else stretch
        since = (found[TIME] - found[TIME].iloc[0]).to_numpy()
        stresses = found[column].to_numpy(), expected[column].to_numpy()
        yield Trace(str(name), x, since, *stresses, fit.modes[str(name)].fitted)


def along_words(mode: str) -> str:
    """What recordings of a mode are drawn over."""
    return "amount of shear γ [–]" if mode == SHEAR else "stretch λ [–]"


def shades(count: int) -> list[str]:
    """So many colors from dark to light."""
    return [mpl.colors.to_hex(mpl.colormaps["viridis"](0.9 * n / max(count - 1, 1))) for n in range(count)]


def draw_recordings(over_stretch: Axes, over_time: Axes, own: list[Trace], mode: str, stress: str) -> None:
    """Measured as dots, fitted as lines, dashed where held out."""
    for trace, color in zip(own, shades(len(own)), strict=True):
        style = "-" if trace.fitted else "--"
        for axes, x in ((over_stretch, trace.x), (over_time, trace.since)):
            axes.plot(x, trace.measured, ".", color=color, ms=3.5, label="_measured")
            axes.plot(x, trace.expected, style, color=color, lw=1.3, label=trace.name)
    over_time.set_xscale("log")
    finish(over_stretch, along_words(mode), stress)
    finish(over_time, "time since the recording's begin [s]", stress)
    if len(own) <= NAMED:
        over_time.legend(fontsize=7, frameon=False)
