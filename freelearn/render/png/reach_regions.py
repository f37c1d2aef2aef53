"""What actuators on one end block reach together: a region for each place or load."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from freelearn.measurements.beds import FORCE
from freelearn.render.png.canvas import finish, new_figure
from freelearn.render.png.notes import LINE, head_and_foot, lines_of
from freelearn.render.png.reach_names import case_name, shade_beyond
from freelearn.results.reachable import Case, Reachable

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
