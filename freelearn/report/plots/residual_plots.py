"""Error maps: the sign and size of residuals over what is imposed."""

from __future__ import annotations

from textwrap import wrap

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from freelearn.data.beds import PRESSURE, Quantity
from freelearn.queries.curves.curve_rows import measured_quantities, plane
from freelearn.report.plots.canvas import heading, new_figure
from freelearn.report.tables.residual_tables import (
    Limits,
    Strip,
    drawn,
    largest_of,
    limit_text,
    residual_table,
    scale_limits,
    shown_samples,
)

# Axes for a strip of samples' planes, length × twist or what else was imposed, and the size of its marks.
#
# One Axes instead of one per sample, because matplotlib draws sixteen of them in half a second.

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
        if len(here) > 1:
            nearest.append(apart.min(axis=1))
    distance = np.quantile(np.concatenate(nearest), 0.1) if nearest else LARGEST
    return float(np.clip(0.85 * distance, SMALLEST, LARGEST)) ** 2


# Where over length and twist, or what else was imposed, a model is wrong.

# As palette.DIVERGING.
SCALE = "PuOr"
# Letters of a title to an inch.
LETTERS = 11
Place = tuple[float, float, float, float]


def residual_map(predictions: pd.DataFrame, title: str, simulated: bool, limits: Limits | None = None) -> Figure:
    """A field per sample, a row each for force and moment, or what else was measured: mean residual over pressure at
    each length and twist, or what else was imposed.

    Scales are symmetric about zero. Each field has its own, written above it, because samples differ a hundredfold in
    load. Gray dots are states without a usable row. The two rows lie side by side where there is one sample.
    predictions: columns of predictions.csv. limits: ends of the scales that this map shares with others, of
    scale_limits; by default its own, and with them each field says how large its own residuals are.
    """
    over, shown = plane(predictions), measured_quantities(predictions)
    ends = scale_limits([predictions], over, shown) if limits is None else limits
    samples, note = shown_samples(predictions)
    alone = len(samples) <= 1
    inside = predictions["sample"].isin(samples)
    table, fewer = drawn(residual_table(predictions if inside.all() else predictions[inside], over))
    strip, note = Strip(table, samples, over), ", ".join(part for part in (note, fewer) if part)
    if alone:
        figure = new_figure(5.1 * max(len(shown), 1), 4.4)
    else:
        figure = new_figure(min(14.0, 3.5 + 1.6 * len(samples)), 1.2 + 2.6 * len(shown), dpi=80)
    what = "measured − predicted" + (", mean over pressure" if PRESSURE.unit not in {q.unit for q in over} else "")
    # The names of many effects fill more than a line; of more than two lines each is smaller.
    size, name, below = 11, heading(title, simulated), ", ".join(part for part in (what, note) if part)
    if len(lines := wrap(name, int(LETTERS * figure.get_figwidth()))) > 1:
        size, lines = 9, wrap(name, int(LETTERS * 11 / 9 * figure.get_figwidth()))
    figure.suptitle("\n".join([*lines, below]), fontsize=size)
    places = _places(figure, alone, len(shown))
    for number, (quantity, place) in enumerate(zip(shown, places, strict=True), 1):
        axes = figure.add_axes(place)
        frame(strip, axes, bottom=alone or number == len(shown))
        top = draw_residuals(axes, strip, quantity, ends, alone, common=limits is not None)
        if alone:
            _colorbar(figure, place, top, f"{quantity.name}: measured − predicted [{quantity.unit}]")
        elif number == len(shown):
            # One bar for both rows: where samples have scales of their own, colors are shares of the sample's limit.
            both = (place[0], place[1], place[2], places[0][1] + places[0][3] - place[1])
            _colorbar(figure, both, top, "measured − predicted [share of the ± limit above its field]")
    return figure


def _places(figure: Figure, alone: bool, count: int) -> list[Place]:
    """Left, bottom, width and height of the rows' axes; they leave room in inches for labels and color bars."""
    width, height = figure.get_size_inches()
    left, bar = 0.75 / width, 1.05 / width
    if alone:
        each = 1 / max(count, 1) - left - bar
        return [(left + number * (left + each + bar), 0.14, each, 0.66) for number in range(count)]
    row = 2.05 / height
    return [
        (left, 0.58 / height + (count - 1 - number) * 2.82 / height, 1 - left - bar, row) for number in range(count)
    ]


def _colorbar(figure: Figure, place: Place, top: float, label: str) -> None:
    """A bar to the right of `place`. Placed by hand: matplotlib's placing takes room from the fields."""
    left, bottom, width, height = place
    inch = 1 / figure.get_figwidth()
    axes = figure.add_axes((left + width + 0.12 * inch, bottom, 0.15 * inch, height))
    ticks = MaxNLocator(4, symmetric=True)
    figure.colorbar(ScalarMappable(Normalize(-top, top), SCALE), cax=axes, label=label, ticks=ticks)
    # In words: of a negative force more is less.
    for y, side, text in ((1.02, "bottom", "model too low"), (-0.02, "top", "model too high")):
        axes.text(0.0, y, text, transform=axes.transAxes, va=side, fontsize=8)


def colorbar_beside(axes: Axes, top: float, quantity: Quantity, alone: bool) -> None:
    """A bar beside axes, where room is taken from them. top: what draw_residuals gave."""
    figure = axes.get_figure()
    assert figure is not None
    unit = f"[{quantity.unit}]" if alone else "[share of the ± limit above its field]"
    shown = ScalarMappable(Normalize(-top, top), SCALE)
    figure.colorbar(shown, ax=axes, label=f"{quantity.name}: measured − predicted {unit}")


def draw_residuals(axes: Axes, strip: Strip, quantity: Quantity, ends: Limits, alone: bool, common: bool) -> float:
    """All samples' states colored by one quantity's residual; returns the end of the color scale. common: whether the
    scale is that of other maps too."""
    residual, sample = strip.states[quantity.column], strip.states["sample"]
    limits = {number: ends.get((number, quantity.column), 1.0) for number in strip.samples}
    color, top = (residual, max(limits.values(), default=1.0)) if alone else (residual / sample.map(limits), 1.0)
    across, up, known = strip.across(), strip.up(), residual.notna()
    axes.plot(across[~known], up[~known], ".", color="0.6", ms=3)
    axes.scatter(
        across[known],
        up[known],
        c=color[known],
        cmap=SCALE,
        vmin=-top,
        vmax=top,
        s=marker_area(strip, axes),
        marker="s",
        # A residual of zero is nearly white: without an edge it would look like a missing state.
        edgecolors="0.6",
        linewidths=0.3,
    )
    for number, limit in limits.items():
        own = known & (sample == number)
        label = f"sample {number}"
        if own.any():
            here = limit_text(largest_of(residual[own]), quantity.unit).replace("± ", "")
            parts = [*([] if alone else [limit_text(limit, quantity.unit)]), *([f"largest {here}"] if common else [])]
            label = "\n".join([label, ", ".join(parts)]) if parts else label
        where = axes.get_xaxis_transform()
        axes.text(strip.middle(number), 1.02, label, transform=where, ha="center", va="bottom", fontsize=9)
    return top
