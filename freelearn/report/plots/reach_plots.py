"""What pressures reach, as pictures."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from freelearn.common.display import COLORS
from freelearn.data.beds import FORCE, PRESSURE, Pair
from freelearn.queries.curves.shown_states import place_text
from freelearn.queries.maps.reach import Case, Reachable
from freelearn.report.plots.canvas import LINE, finish, head_and_foot, heading, lines_of, new_figure
from freelearn.report.tables.residual_tables import MOST_SAMPLES

# What places, loads and samples are called in pictures of what is reached, and where the bed did not go.

BEYOND = "0.93"


def place_name(found: Reachable, case: Case) -> str:
    """The two imposed quantities of a case."""
    text = place_text(case.points.iloc[0], found.imposed)
    return re.sub(r"\+0(?=[ °])", "0", text).replace("-", "−")


def case_name(found: Reachable, case: Case, cases: Sequence[Case]) -> str:
    """What tells a case from the others."""
    several = len({other.sample for other in cases}) > 1
    parts = [f"sample {case.sample}" + ("" if case.sample in found.fitted else " (not fitted)")] if several else []
    if len({(other.first, other.second) for other in cases}) > 1:
        parts.append(place_name(found, case))
    return ", ".join(parts) or f"sample {case.sample}"


def shade_beyond(found: Reachable, axes: Axes, drawn: Pair) -> list[Patch]:
    """Shades where the bed did not go, if any of that is seen; what a legend says of it. Over a plane of poses."""
    if drawn != found.plane or found.plane[0] is FORCE:
        return []
    (left, right), (low, high) = found.reached.elongation, found.reached.twist
    across, up = axes.get_xlim(), axes.get_ylim()
    if left <= across[0] and across[1] <= right and low <= up[0] and up[1] <= high:
        return []
    axes.set_facecolor(BEYOND)
    axes.add_patch(Rectangle((left, low), right - left, high - low, facecolor="white", edgecolor="none", zorder=0))
    axes.set(xlim=across, ylim=up)
    return [Patch(facecolor=BEYOND, edgecolor="0.7", label="beyond where the bed went")]


# What actuators on one end block reach together: a region for each place or load.

REGION = "#a6cee3"
PANELS_IN_A_ROW = 3
# Inches of a panel with its labels: across, of a single one, and up.
ACROSS, ALONE, UP = 4.2, 7.0, 3.9
# How a text stands to the left of a point, above or below it, and to the right; and below, beside, above.
SIDES = (("right", "center", "left"), ("top", "center", "bottom"))
# Distance of a corner's name from it, points.
AWAY = 6


def reach_regions(found: Reachable, cases: Sequence[Case], name: Sequence[str], notes: Sequence[str]) -> Figure:
    """A panel for each case: all that is reached, filled; the corners of the pressures, named; of loads also the convex
    hull, dashed."""
    columns = min(PANELS_IN_A_ROW, len(cases))
    rows = -(-len(cases) // columns)
    width = ALONE if len(cases) == 1 else ACROSS * columns
    lines = lines_of([*notes, _numbers(found)], width)
    figure = new_figure(width, 1.5 + UP * rows + LINE * len(lines))
    height = figure.get_figheight()
    above = head_and_foot(figure, name, lines)
    grid = figure.add_gridspec(
        rows, columns, left=0.75 / width, right=1 - 0.2 / width, bottom=(above + 0.75) / height, top=1 - 0.85 / height,
        wspace=0.28, hspace=0.35,
    )  # fmt: skip
    beyond: list[Patch] = []
    for number, case in enumerate(cases):
        axes = figure.add_subplot(grid[divmod(number, columns)])
        _draw(found, case, axes)
        finish(axes, found.plane[0].label, found.plane[1].label)
        beyond = shade_beyond(found, axes, found.plane) or beyond
        if len(cases) > 1:
            axes.set_title(case_name(found, case, cases), fontsize=9.5)
    handles: list[Patch | Line2D] = [Patch(facecolor=REGION, edgecolor="0.5", label="within reach")]
    if found.plane[0] is FORCE:
        handles.append(Line2D([], [], color="black", ls="--", lw=1, label="convex hull of it"))
    handles.append(Line2D([], [], color="black", marker="o", ls="", ms=4.5, label="corner of the pressures"))
    figure.legend(
        handles=[*handles, *beyond], loc="lower center", ncols=4, frameon=False, fontsize=8.5,
        bbox_to_anchor=(0.5, above / height),
    )  # fmt: skip
    return figure


def _draw(found: Reachable, case: Case, axes: Axes) -> None:
    points = case.points[[q.column for q in found.plane]].to_numpy(np.float64)
    cells = points[found.grid.cells]
    cells = cells[np.isfinite(cells).all(axis=(1, 2))]
    # Opaque, so that what is reached in two ways is no darker.
    axes.add_collection(PolyCollection(list(cells), facecolors=REGION, edgecolors=REGION, linewidths=0.6))
    vertices = case.points.dropna(subset="vertex").sort_values("vertex")
    outline = points[vertices.index.to_numpy()]
    if found.plane[0] is FORCE and len(outline):
        axes.plot(*np.r_[outline, outline[:1]].T, "--", color="black", lw=1)
    corners = case.points.index[(case.points["corner"] != "") & (case.points["status"] == "ok")]
    for row in corners:
        axes.plot(*points[row], "o", color="black", ms=3.5)
        _name(axes, points[row], outline, str(case.points["corner"][row]))
    axes.autoscale_view()
    axes.margins(0.2, 0.1)
    # Rounding is not to look like a region.
    if found.plane[0] in found.silent:
        axes.set_xlim(-1.0, 1.0)
    if found.plane[1] in found.silent:
        axes.set_ylim(-1.0, 1.0)


def _name(axes: Axes, here: np.ndarray, outline: np.ndarray, text: str) -> None:
    """Writes beside a corner, on the side that is away from the middle of the outline."""
    extent = np.ptp(outline, axis=0)
    away = (here - outline.mean(axis=0)) / np.where(extent > 0, extent, 1.0)
    away = away / (float(np.hypot(*away)) or 1.0)
    # Text begins where it is nearest to its point.
    ha, va = (names[int(np.sign(np.round(part))) + 1] for names, part in zip(SIDES, away, strict=True))
    at, beside = (float(here[0]), float(here[1])), (AWAY * float(away[0]), AWAY * float(away[1]))
    axes.annotate(text, at, beside, textcoords="offset points", fontsize=8, ha=ha, va=va)


def _numbers(found: Reachable) -> str:
    """What the corners' names stand for."""
    ends = zip(found.grid.quantities, found.grid.levels[:, 0], found.grid.levels[:, -1], strict=True)
    pressures = ", ".join(f"{q.symbol} from {low:.3g} to {high:.3g}" for q, low, high in ends).replace("-", "−")
    levels = found.grid.levels.shape[1]
    return (
        f"Numbers: actuators at their highest pressure, the others at their lowest. {pressures} kPa, {levels} levels."
    )


# What single actuators reach: a curve over the pressure for each place or sample.

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


def reachable(found: Reachable, title: str, simulated: bool) -> Figure:
    """Loads at a place, or poses under a load, over all pressures within reach. title: the model.

    Single actuators share one panel, in which marks are even steps of the pressure; actuators on an end block have a
    panel for each place, with the corners of what is reached named by the pressures that make them.
    """
    cases = list(found.cases())
    shown = cases[:MOST_SAMPLES]
    more = [f"Shown: first {len(shown)} of {len(cases)}."] if len(cases) > len(shown) else []
    what, here = "poses within reach", place_name(found, shown[0])
    if found.plane[0] is FORCE:
        same = len({(case.first, case.second) for case in shown}) == 1
        what = "loads within reach" + (f" at {here}" if same else "")
    else:
        free = not (shown[0].first or shown[0].second)
        what += " of a free end" if free else f" under {here}"
    draw = reach_regions if found.several else reach_curves
    return draw(found, shown, [heading(title, simulated), what], [*found.notes, *more])
