"""Error of every training set (across) on every test set (down)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from freelearn.data.sets import CONSTITUENT_SET
from freelearn.report.plots.canvas import new_figure
from freelearn.report.tables.error_map import WORST, cell_text, error_grid, error_range, mean_text, set_order

# Small errors are bright; the lightness falls all along, so the map survives grayscale and color blindness.
SCALE = "viridis_r"
# The maps of a model lie between a few and a few thousand percent: a linear scale would show one dark corner.
TICKS = [m * 10.0**e for e in range(-2, 6) for m in (1, 2, 5)]
NAMES = {CONSTITUENT_SET: "constit."}
CELL = 0.4
# Inches of the color bar with its numbers, and of the widest picture of several maps.
BAR, WIDEST = 1.2, 15.0
# Letters of a title on one line.
LETTERS = 46


def color_scale(cells: pd.DataFrame) -> LogNorm:
    """One logarithmic scale [%] for every map drawn from `cells` (column E, a fraction)."""
    return LogNorm(*error_range(cells))


def heatmap(cells: pd.DataFrame, title: str, norm: LogNorm, note: str) -> Figure:
    """One map with its mean and median above it. cells: see draw_map."""
    across, down = set_order(cells["train"]), set_order(cells["test"])
    lines = wrap(title, LETTERS)
    left, foot, head = 1.1, 0.95, 0.62 + 0.22 * len(lines)
    # The words above need their room also over a map of few columns.
    width = max(left + CELL * len(across) + 1.15, 4.6)
    figure = new_figure(width, head + foot + CELL * len(down))
    height = figure.get_figheight()
    axes = figure.add_axes((left / width, foot / height, CELL * len(across) / width, CELL * len(down) / height))
    draw_map(axes, cells, norm)
    top = 1 - 0.1 / height
    figure.text(0.02, top, "\n".join(lines), fontsize=10.5, va="top", weight="bold")
    figure.text(0.02, top - 0.22 * len(lines) / height, f"{mean_text(cells)}; {note}", fontsize=8.5, va="top")
    add_bar(figure, (left + CELL * len(across) + 0.15) / width, foot / height, CELL * len(down) / height, norm)
    return figure


def side_by_side(
    cells: pd.DataFrame, labels: Sequence[str], captions: Mapping[str, str], title: str, norm: LogNorm
) -> Figure:
    """The maps of all labels on one scale, in as many rows as they need; under each its caption, such as published
    figures."""
    across, down = set_order(cells["train"]), set_order(cells["test"])
    lines = max((text.count("\n") + 1 for text in captions.values()), default=0)
    wide, high = CELL * len(across), CELL * len(down)
    # Under a map its names of sets and its caption, over it two lines; captions are wider than a map of few columns.
    left, head, above, below = 0.95, 0.5, 0.45, 0.95 + 0.155 * lines
    gap = max(0.25, 2.9 - wide)
    columns = min(len(labels), max(1, int((WIDEST - left - BAR) / (wide + gap))))
    rows = -(-len(labels) // columns)
    width = left + columns * (wide + gap) + BAR
    height = head + rows * (above + high + below)
    figure = new_figure(width, height)
    for number, label in enumerate(labels):
        row, column = divmod(number, columns)
        x, y = left + column * (wide + gap), height - head - row * (above + high + below) - above - high
        axes = figure.add_axes((x / width, y / height, wide / width, high / height))
        part = cells[cells["label"] == label]
        draw_map(axes, part, norm, across, down, first=column == 0)
        axes.set_title(f"{label}\n{mean_text(part)}", fontsize=9, loc="left")
        place = (y - 0.85) / height
        figure.text(x / width, place, captions.get(label, ""), fontsize=8, va="top", family="monospace")
        if column == columns - 1 or number == len(labels) - 1:
            add_bar(figure, (x + wide + 0.15) / width, y / height, high / height, norm)
    figure.text(0.1 / width, 1 - 0.1 / height, title, fontsize=11, va="top", weight="bold")
    return figure


def draw_map(
    axes: Axes,
    cells: pd.DataFrame,
    norm: LogNorm,
    across: list[str] | None = None,
    down: list[str] | None = None,
    first: bool = True,
) -> None:
    """cells: train, test, E (a fraction). Hatched cells were not evaluated, or have no usable row."""
    across, down = across or set_order(cells["train"]), down or set_order(cells["test"])
    values = error_grid(cells, across, down)
    axes.patch.set(hatch="////", edgecolor="0.75", facecolor="white")
    edges = np.arange(len(across) + 1) - 0.5, np.arange(len(down) + 1) - 0.5
    axes.pcolormesh(*edges, np.ma.masked_invalid(values), norm=norm, cmap=SCALE, edgecolors="white", linewidth=0.5)
    axes.invert_yaxis()
    axes.set_xticks(range(len(across)), [NAMES.get(n, n) for n in across], rotation=60, ha="right", fontsize=8.5)
    axes.set_xlabel("training set; hatched: not evaluated" if np.isnan(values).any() else "training set")
    axes.set_yticks(range(len(down)), [NAMES.get(n, n) for n in down] if first else [""] * len(down), fontsize=8.5)
    if first:
        axes.set_ylabel("test set")
    axes.tick_params(length=0)
    for name in set(across) & {CONSTITUENT_SET}:
        # Nothing was fitted there: set off from the columns of training sets.
        axes.axvline(list(across).index(name) - 0.5, color="black", linewidth=1.2)
    known = values[np.isfinite(values)]
    extremes = {float(known.min()), float(known.max())} if len(known) else set()
    for (row, column), value in np.ndenumerate(values):
        # Where white is read more easily than black on viridis.
        ink = "white" if norm(max(value, norm.vmin or 0.0)) > 0.58 else "black"
        weight = "bold" if float(value) in extremes else "normal"
        axes.text(column, row, cell_text(value), ha="center", va="center", color=ink, fontsize=7.5, weight=weight)


def add_bar(figure: Figure, x: float, y: float, height: float, norm: LogNorm) -> None:
    """The color bar, at figure coordinates."""
    axes = figure.add_axes((x, y, 0.16 / figure.get_size_inches()[0], height))
    _label(figure.colorbar(ScalarMappable(norm, SCALE), cax=axes), norm)


def add_bar_beside(axes: Axes, norm: LogNorm) -> None:
    """The color bar beside a map, where room is taken from it."""
    figure = axes.get_figure()
    assert figure is not None
    _label(figure.colorbar(ScalarMappable(norm, SCALE), ax=axes), norm)


def _label(bar: Colorbar, norm: LogNorm) -> None:
    assert norm.vmin is not None
    assert norm.vmax is not None
    bar.ax.yaxis.set_major_locator(FixedLocator([t for t in TICKS if norm.vmin <= t <= norm.vmax]))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    # Where the scale ends before the errors do.
    bar.set_label("error E [%], logarithmic" + (", darkest: more" if norm.vmax >= WORST else ""), fontsize=8.5)
    bar.ax.tick_params(labelsize=8)
