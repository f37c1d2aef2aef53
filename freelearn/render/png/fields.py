"""Axes for a strip of samples' planes, length × twist or what else was imposed, and the size of its marks.

One Axes instead of one per sample, because matplotlib draws sixteen of them in half a second.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from freelearn.results.strip import Strip

SMALLEST, LARGEST = 3.5, 15.0
MOST_COMPARED = 1500
# With more fields than this only two ticks stand under each.
FEW = 4


def frame(strip: Strip, axes: Axes, bottom: bool) -> None:
    """Limits, labels with units, the lines between fields, and each field's ticks at the bottom row."""
    count = max(len(strip.samples), 1)
    axes.set_xlim(strip.low, strip.low + count * strip.width)
    axes.set_ylim(strip.bottom, strip.top)
    axes.vlines(strip.low + strip.width * np.arange(1, count), strip.bottom, strip.top, color="black", lw=0.8)
    ticks = np.asarray(MaxNLocator(5 if count == 1 else 2).tick_values(strip.low, strip.high))
    # Off the field's edges, where labels of neighbors would touch.
    ticks = ticks[(ticks > strip.low + 0.05 * strip.width) & (ticks < strip.high - 0.05 * strip.width)]
    if count > FEW and len(ticks) > 2:
        # Each tick takes a millisecond to draw; the outer two still give the scale.
        ticks = ticks[[0, -1]]
    if bottom:
        labels = [f"{tick:g}".replace("-", "−") for tick in ticks]
        place = [tick + strip.left(sample) for sample in strip.samples for tick in ticks]
        axes.set_xticks(place, labels * len(strip.samples))
        axes.set_xlabel(strip.x.label)
    else:
        axes.set_xticks([])
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.set_ylabel(strip.y.label)


def marker_area(strip: Strip, axes: Axes) -> float:
    """Area of a square marker [points²] that fills the distance between the closest tenth of neighboring states."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    place = axes.get_position()
    points = 72 * np.array(figure.get_size_inches()) * (place.width, place.height)
    scale = points / (strip.width * max(len(strip.samples), 1), strip.top - strip.bottom)
    nearest = []
    for _, part in strip.states.groupby("sample"):
        here = part[[strip.x.column, strip.y.column]].to_numpy(dtype=np.float64)[:MOST_COMPARED] * scale
        apart = np.abs(here[:, None] - here).max(axis=2)
        np.fill_diagonal(apart, np.inf)
        nearest.append(apart.min(axis=1))
    distance = np.quantile(np.concatenate(nearest), 0.1) if nearest else LARGEST
    return float(np.clip(0.85 * distance, SMALLEST, LARGEST)) ** 2
