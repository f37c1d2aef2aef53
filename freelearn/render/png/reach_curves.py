"""What single actuators reach: a curve over the pressure for each place or sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from freelearn.measurements.beds import PRESSURE
from freelearn.render.palette import COLORS
from freelearn.render.png.canvas import finish, new_figure
from freelearn.render.png.notes import LINE, head_and_foot, lines_of
from freelearn.render.png.reach_names import case_name, shade_beyond
from freelearn.results.reachable import Case, Reachable

MARKERS = "osD^vP*X"
# Marks along a curve, both ends among them.
MARKS = 5
WIDTH, HEIGHT = 8.6, 5.0


def reach_curves(found: Reachable, cases: Sequence[Case], name: Sequence[str], notes: Sequence[str]) -> Figure:
    """All cases in one panel; over the pressure, where one of the two quantities is zero throughout.

    Marks are even steps of the pressure, filled at the highest; lines of samples that were not fitted are dashed.
    """
    lines = lines_of(notes, WIDTH)
    figure = new_figure(WIDTH, HEIGHT + LINE * len(lines))
    bottom = (head_and_foot(figure, name, lines) + 0.45) / figure.get_figheight()
    axes = figure.add_axes((0.1, bottom, 0.59, 0.875 - bottom))
    across, up = found.plane
    if len(found.silent) == 1:
        (nothing,) = found.silent
        across, up = PRESSURE, (up if nothing is across else across)
        axes.set_title(f"{nothing.symbol} = 0{nothing.suffix} throughout", fontsize=9, loc="left")
    levels = found.grid.levels[0]
    marks = np.unique(np.linspace(0, len(levels) - 1, MARKS).round().astype(int))
    handles: list[Line2D | Patch] = []
    for i, case in enumerate(cases):
        color, marker = COLORS[i % len(COLORS)], MARKERS[i % len(MARKERS)]
        points = case.points[[across.column, up.column]].to_numpy(np.float64)
        points[(case.points["status"] != "ok").to_numpy()] = np.nan
        style, label = "-" if case.sample in found.fitted else "--", case_name(found, case, cases)
        axes.plot(*points.T, style, color=color, lw=1.6, label=label)
        axes.plot(*points[marks[:-1]].T, marker, color=color, ms=5.5, mfc="white", mew=1.2)
        axes.plot(*points[marks[-1:]].T, marker, color=color, ms=7)
        handles.append(Line2D([], [], color=color, marker=marker, ls=style, label=label))
    finish(axes, across.label, up.label)
    axes.margins(0.06)
    open_at = ", ".join(f"{levels[mark]:.3g}" for mark in marks[:-1]).replace("-", "−")
    handles.append(Line2D([], [], color="0.3", ls="", marker="o", mfc="white", label=f"at {open_at} kPa"))
    handles.append(Line2D([], [], color="0.3", ls="", marker="o", label=f"at {levels[-1]:.3g} kPa"))
    handles += shade_beyond(found, axes, (across, up))
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0.7, 0.9), frameon=False, fontsize=8.5, alignment="left"
    )
    return figure
