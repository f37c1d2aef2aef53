"""Recordings of rubber: stress against stretch, and over the logarithm of time, measured and fitted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from freelearn.data.specimen_schema import SHEAR, shear_of_stretch
from freelearn.data.specimen_tests import TIME, names_of, timed
from freelearn.fitting.rubber_fit import RubberFit
from freelearn.report.plots.canvas import finish

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
