"""Error of every training set (across) on every test set (down)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from freelearn.render.png.canvas import new_figure
from freelearn.results.error_map import error_grid, error_range, mean_text, set_order
from freelearn.results.run import CONSTITUENT_SET

# Small errors are bright; the lightness falls all along, so the map survives grayscale and color blindness.
SCALE = "viridis_r"
# The maps of a model lie between a few and a few thousand percent: a linear scale would show one dark corner.
TICKS = [m * 10.0**e for e in range(-2, 6) for m in (1, 2, 5)]
NAMES = {CONSTITUENT_SET: "constit."}
CELL = 0.42


def color_scale(cells: pd.DataFrame) -> LogNorm:
    """One logarithmic scale [%] for every map drawn from `cells` (column E, a fraction)."""
    return LogNorm(*error_range(cells))


def heatmap(cells: pd.DataFrame, title: str, norm: LogNorm, note: str) -> Figure:
    """One map with the mean above it, and its smallest and largest cells written in. cells: see draw_map."""
    across, down = set_order(cells["train"]), set_order(cells["test"])
    figure = new_figure(2.9 + CELL * len(across), 1.9 + CELL * len(down))
    width, height = figure.get_size_inches()
    axes = figure.add_axes((1.1 / width, 0.95 / height, CELL * len(across) / width, CELL * len(down) / height))
    draw_map(axes, cells, norm)
    figure.text(0.02, 1 - 0.12 / height, title, fontsize=11, va="top", weight="bold")
    figure.text(0.02, 1 - 0.34 / height, note, fontsize=8.5, va="top")
    figure.text(0.02, 1 - 0.53 / height, f"mean {mean_text(cells)}", fontsize=10, va="top")
    add_bar(figure, (1.25 + CELL * len(across)) / width, 0.95 / height, CELL * len(down) / height, norm)
    return figure


def side_by_side(
    cells: pd.DataFrame, labels: Sequence[str], captions: Mapping[str, str], title: str, norm: LogNorm
) -> Figure:
    """The maps of several labels on one scale; under each its caption, such as published figures."""
    across, down = set_order(cells["train"]), set_order(cells["test"])
    cell = 0.3
    lines = max((text.count("\n") + 1 for text in captions.values()), default=0)
    foot, head, left = 0.95 + 0.155 * lines, 0.75, 0.95
    # Room for the captions, which are wider than a map of few columns.
    gap = max(0.25, 2.3 - cell * len(across))
    width = left + len(labels) * (cell * len(across) + gap) + 1.2
    height = foot + head + cell * len(down)
    figure = new_figure(width, height)
    for number, label in enumerate(labels):
        x = left + number * (cell * len(across) + gap)
        place = (x / width, foot / height, cell * len(across) / width, cell * len(down) / height)
        axes = figure.add_axes(place)
        part = cells[cells["label"] == label]
        draw_map(axes, part, norm, across, down, first=number == 0)
        axes.set_title(f"{label}\nmean {mean_text(part)}", fontsize=9.5, loc="left")
        text = captions.get(label, "")
        figure.text(x / width, (0.155 * lines + 0.1) / height, text, fontsize=8, va="top", family="monospace")
    figure.text(0.01, 1 - 0.1 / height, title, fontsize=11, va="top", weight="bold")
    if cells.groupby("label")["train"].nunique().nunique() > 1:
        figure.text(0.99, 0.05 / height, "hatched: not evaluated", fontsize=8, va="bottom", ha="right")
    add_bar(figure, (width - 1.05) / width, foot / height, cell * len(down) / height, norm)
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
    axes.set_xticks(range(len(across)))
    axes.set_xlabel("training set")
    axes.set_yticks(range(len(down)), [NAMES.get(n, n) for n in down] if first else [""] * len(down), fontsize=8.5)
    if first:
        axes.set_ylabel("test set")
    axes.tick_params(length=0)
    for name in set(across) & {CONSTITUENT_SET}:
        # Nothing was fitted there: set off from the columns of training sets.
        axes.axvline(list(across).index(name) - 0.5, color="black", linewidth=1.2)
    if np.isfinite(values).any():
        for extreme in (np.nanargmin(values), np.nanargmax(values)):
            row, column = divmod(int(extreme), len(across))
            value = float(values[row, column])
            ink = "white" if norm(value) > 0.55 else "black"
            text = f"{value:.1f}" if value < 100 else f"{value:.0f}"
            axes.text(column, row, text, ha="center", va="center", color=ink, fontsize=8, weight="bold")


def add_bar(figure: Figure, x: float, y: float, height: float, norm: LogNorm) -> None:
    """The color bar, at figure coordinates."""
    axes = figure.add_axes((x, y, 0.16 / figure.get_size_inches()[0], height))
    bar = figure.colorbar(ScalarMappable(norm, SCALE), cax=axes)
    assert norm.vmin is not None
    assert norm.vmax is not None
    bar.ax.yaxis.set_major_locator(FixedLocator([t for t in TICKS if norm.vmin <= t <= norm.vmax]))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    bar.set_label("error E [%], logarithmic")
    bar.ax.tick_params(labelsize=8)
