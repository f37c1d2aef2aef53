"""What was measured against pressure, and against each other, at one kinematic state."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path

from freelearn.common.display import COLORS
from freelearn.common.formats import MINUS
from freelearn.queries.curves.curve_panels import (
    LOOSE,
    SUSPECTED,
    CurvePanel,
    loose,
    measured_points,
    panels_of,
    read,
    suspected_points,
)
from freelearn.queries.curves.model_curves import BAND, ends, has_band, strip
from freelearn.report.plots.canvas import finish, heading, new_figure

# As matplotlib's, which has no name for it.
LineStyle = Literal["-"] | tuple[float, tuple[float, ...]]
PANEL = 4.0  # inches
# Marks belong to what was measured: models differ by color and dashes, and the later is the thinner, so that two which
# lie on each other are both seen. Lighter and thin: beyond the measured pressures.
STYLES: tuple[tuple[LineStyle, float], ...] = (
    ("-", 2.6),
    ((0, (6, 2)), 2.0),
    ((0, (1, 1.6)), 2.0),
    ((0, (7, 2, 1.5, 2)), 1.8),
    ((0, (3, 1.5)), 1.6),
    ((0, (7, 2, 1.5, 2, 1.5, 2)), 1.6),
)
BEYOND = 1.1
# Two lines are one up to so much of what they span.
SAME = 0.004
# Matplotlib leaves labels that begin with _ out of the legend.
_BEYOND = "_beyond"
# Of a band: two of them on each other stay lighter than a line.
FILL, EDGE = 0.16, 0.5


def curves(
    measured: pd.DataFrame, models: Mapping[str, pd.DataFrame] | pd.DataFrame, title: str, simulated: bool
) -> Figure:
    """Three panels, F–P, M–P and F–M, or those of what else was measured: measured rows as black squares (open where
    the pressure fell), models as lines.

    measured: measurement columns of one kinematic state, in time order; buckled and left-out rows are not drawn,
    those in which the tube hangs loose as hollow diamonds, and suspected readings (see suspects.flagged) as hollow
    crosses, at the edge with their values where they lie beyond it. models: by name (or one alone, then called
    "model"), frames of model_curve, drawn in their own order; the line is thin and light beyond the measured pressures,
    and where the frame has a band, that is filled in the line's color over the pressure.
    """
    named = {"model": models} if isinstance(models, pd.DataFrame) else models
    shown, panels = measured_points(measured), panels_of(measured)
    width = max(PANEL * len(panels), 1.5 * PANEL)
    figure = new_figure(width, 4.3)
    figure.suptitle(heading(title.replace("-", MINUS), simulated), fontsize=12 if len(panels) > 1 else 10)
    figure.subplots_adjust(left=0.9 / width, right=1 - 0.18 / width, bottom=0.225, top=0.89, wspace=0.29)
    entries: dict[str, Any] = {}
    for number, panel in enumerate(panels, 1):
        axes = figure.add_subplot(1, len(panels), number)
        if draw_curves(axes, shown, named, panel, first=number == 1):
            # In the color of each model that has one.
            filled = zip(named.values(), cycle(COLORS), strict=False)
            entries[BAND] = tuple(
                Patch(facecolor=(color, 2 * FILL), edgecolor=color, lw=0.5)
                for curve, color in filled
                if has_band(curve, panel.line[1])
            )
        # A suspected moment is in no panel of the force alone.
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if BAND in entries:
        # What was measured first, then the models: that which goes with each of them behind.
        entries[BAND] = entries.pop(BAND)
    _legend_below(figure, entries)
    return figure


def draw_curves(
    axes: Axes, shown: pd.DataFrame, named: Mapping[str, pd.DataFrame], panel: CurvePanel, first: bool
) -> bool:
    """Draws one panel; whether a band is in it. shown: of curve_panels.measured_points; named: models' curves, as of
    `curves`; first: whether the legend's word for what lies beyond the measured pressures is this panel's to say."""
    banded = False
    # Squares first in the legend, lines above nothing: a square hidden by its own model looks like a missing one.
    _points(axes, shown, named, panel)
    for (name, curve), color, style in zip(named.items(), cycle(COLORS), cycle(STYLES), strict=False):
        _line(axes, curve, *panel.line, name, color, *style)
        banded |= panel.banded and _band(axes, curve, *panel.line, color)
    finish(axes, panel.x.label, panel.y.label)
    axes.locator_params(nbins=6)
    axes.locator_params(axis="x", nbins=5)
    if first and any(curve["extrapolated"].any() for curve in named.values()):
        axes.plot([], [], "-", color="0.6", lw=BEYOND, label="beyond the measured pressures")
    return banded


def _legend_below(figure: Figure, entries: dict[str, Any]) -> None:
    """Below the panels: inside them every corner may hold data. As many columns as fit, and room for their rows."""
    width, height = figure.get_size_inches() * figure.dpi
    for columns in range(len(entries), 0, -1):
        legend = figure.legend(
            entries.values(),
            entries.keys(),
            loc="lower center",
            ncols=columns,
            frameon=False,
            fontsize=9,
            handler_map={tuple: HandlerTuple(None, pad=0.3)},
        )
        box = legend.get_window_extent()
        if box.width <= width or columns == 1:
            break
        legend.remove()
    bottom = figure.subplotpars.bottom
    label = 0.45 * figure.dpi / height
    figure.subplots_adjust(bottom=max(bottom, box.y1 / height + label))


def _points(axes: Axes, shown: pd.DataFrame, named: Mapping[str, pd.DataFrame], panel: CurvePanel) -> None:
    """What was measured, and apart from it what is suspected to have slipped."""
    squares, crosses = shown[read(shown, panel)], suspected_points(shown, named, panel)
    falling = squares["falling"]
    for rows, fill, label in ((~falling, "black", "measured, rising"), (falling, "white", "measured, falling")):
        if rows.any():
            across, up = squares.loc[rows, panel.x.column], squares.loc[rows, panel.y.column]
            axes.plot(across, up, "s", color="black", mfc=fill, ms=5, label=label, zorder=3)
    slack = shown[loose(shown, panel)]
    if len(slack):
        axes.plot(
            slack[panel.x.column], slack[panel.y.column], "d", color="0.4", mfc="white", ms=7, label=LOOSE, zorder=2
        )
    if len(crosses):
        axes.plot(crosses["across"], crosses["up"], "X", color="black", mfc="white", ms=9, label=SUSPECTED, zorder=4)
        for across, up, text in zip(crosses["across"], crosses["up"], crosses["beyond"], strict=True):
            # Towards the middle: most of them stand at the edge.
            left = across > np.mean(axes.get_xlim())
            axes.annotate(
                text.strip(), (across, up), xytext=(-8 if left else 8, 0), textcoords="offset points", fontsize=8,
                ha="right" if left else "left", va="center", bbox={"color": "white", "alpha": 0.8, "pad": 1}, zorder=4,
            )  # fmt: skip


def _line(
    axes: Axes, curve: pd.DataFrame, x: str, y: str, name: str, color: str, style: LineStyle, wide: float
) -> None:
    """One model: in its style where measured, light beyond; the two share the point between them."""
    across, up = curve[x].to_numpy(), curve[y].to_numpy()
    outside = curve["extrapolated"].to_numpy(dtype=bool)
    for part in _stretches(outside):
        axes.plot(across[part], up[part], "-", color=_lighter(color), lw=BEYOND, label=_BEYOND)
    inside = np.where(outside, np.nan, across)
    if style != "-":
        inside = np.where(_retraced(inside, up), np.nan, inside)
    axes.plot(inside, up, ls=style, color=color, lw=wide, label=name)


def _retraced(across: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Which points lie on the line's own way to where it is farthest from its beginning, (n,) bool: without memory a
    model comes back along it, and dashes on dashes would be a line."""
    known = np.flatnonzero(np.isfinite(across) & np.isfinite(up))
    retraced = np.zeros(len(across), dtype=bool)
    if len(known) < 3:
        return retraced
    points = np.c_[across[known], up[known]]
    points = (points - points[0]) / np.maximum(np.ptp(points, axis=0), 1e-300)
    turn = int(np.argmax(np.linalg.norm(points, axis=1)))
    starts, ways = points[:turn], np.diff(points[: turn + 1], axis=0)
    if not len(ways) or turn == len(points) - 1:
        return retraced
    back = points[turn + 1 :, None]
    share = ((back - starts) * ways).sum(-1) / np.maximum((ways**2).sum(-1), 1e-300)
    nearest = starts + share.clip(0, 1)[..., None] * ways
    retraced[known[turn + 1 :]] = np.linalg.norm(back - nearest, axis=-1).min(1) < SAME
    return retraced


def _band(axes: Axes, curve: pd.DataFrame, x: str, y: str, color: str) -> bool:
    """Fills one model's band, below every line; whether there is any. Its thin edge is what tells it from another
    model's in print without color."""
    across, one, other = strip(curve, x, y).T
    if not len(across):
        return False
    around = np.r_[np.c_[across, one], np.c_[across, other][::-1]]
    axes.add_patch(PathPatch(Path(around), facecolor=(color, FILL), lw=0, zorder=1))
    for end in ends(y):
        axes.plot(curve[x], curve[end], "-", color=_lighter(color), lw=0.7, zorder=1)
    return True


def _lighter(color: str) -> tuple[float, ...]:
    """Not transparent: the edges of the way up and of the way down may lie on each other."""
    return tuple(1 - EDGE * (1 - part) for part in to_rgb(color))


def _stretches(outside: np.ndarray) -> list[slice]:
    """Each run of extrapolated points, widened by the neighbors inside that it joins on to, so no gap shows."""
    edges = np.flatnonzero(np.diff(np.r_[False, outside, False].astype(int)))
    return [slice(max(0, start - 1), stop + 1) for start, stop in zip(edges[::2], edges[1::2], strict=True)]
