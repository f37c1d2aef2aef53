"""Where over length and twist a model is wrong."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from freelearn.render.png.canvas import heading, new_figure
from freelearn.render.png.fields import frame, marker_area
from freelearn.results.residuals import LOADS, Load, limit_text, residual_table, scale_end, shown_samples
from freelearn.results.strip import Strip

# As palette.DIVERGING.
SCALE = "PuOr"
Place = tuple[float, float, float, float]


def residual_map(predictions: pd.DataFrame, title: str, simulated: bool) -> Figure:
    """A field per sample, a row each for force and moment: mean residual over pressure at each length and twist.

    Scales are symmetric about zero. Each field has its own, written above it, because samples differ a hundredfold in
    load. Gray dots are states without a usable row. The two rows lie side by side where there is one sample.
    predictions: columns of predictions.csv.
    """
    samples, note = shown_samples(predictions)
    alone = len(samples) <= 1
    strip = Strip(residual_table(predictions[predictions["sample"].isin(samples)]), samples)
    figure = new_figure(10.2, 4.4) if alone else new_figure(min(14.0, 3.5 + 1.6 * len(samples)), 6.4, dpi=80)
    shown = ", ".join(["measured − predicted, mean over pressure", *([note] if note else [])])
    figure.suptitle(f"{heading(title, simulated)}\n{shown}", fontsize=11)
    for number, (load, place) in enumerate(zip(LOADS, _places(figure, alone), strict=True)):
        axes = figure.add_axes(place)
        frame(strip, axes, bottom=alone or number == 1)
        top = _draw(axes, strip, load, alone)
        if alone:
            _colorbar(figure, place, top, f"{load.name} residual [{load.unit}]")
        elif number == 1:
            # One bar for both rows: where samples have scales of their own, colors are shares of the sample's limit.
            both = (place[0], place[1], place[2], 0.85 - place[1])
            _colorbar(figure, both, top, "residual [share of the ± limit above its field]")
    return figure


def _places(figure: Figure, alone: bool) -> list[Place]:
    """Left, bottom, width and height of the two rows' axes; they leave room in inches for labels and color bars."""
    width = figure.get_figwidth()
    left, bar = 0.75 / width, 1.05 / width
    if alone:
        each = (1 - 2 * (left + bar)) / 2
        return [(left, 0.14, each, 0.66), (2 * left + each + bar, 0.14, each, 0.66)]
    return [(left, 0.53, 1 - left - bar, 0.32), (left, 0.09, 1 - left - bar, 0.32)]


def _colorbar(figure: Figure, place: Place, top: float, label: str) -> None:
    """A bar to the right of `place`. Placed by hand: matplotlib's placing takes room from the fields."""
    left, bottom, width, height = place
    inch = 1 / figure.get_figwidth()
    axes = figure.add_axes((left + width + 0.12 * inch, bottom, 0.15 * inch, height))
    ticks = MaxNLocator(4, symmetric=True)
    figure.colorbar(ScalarMappable(Normalize(-top, top), SCALE), cax=axes, label=label, ticks=ticks)


def _draw(axes: Axes, strip: Strip, load: Load, shared: bool) -> float:
    """All samples' states colored by one load's residual; returns the end of the color scale."""
    residual, sample = strip.states[load.column], strip.states["sample"]
    limits = {number: scale_end(residual[sample == number]) for number in strip.samples}
    color, top = (residual, scale_end(residual)) if shared else (residual / sample.map(limits), 1.0)
    across, twist, known = strip.across(), strip.states["twist_deg"], residual.notna()
    axes.plot(across[~known], twist[~known], ".", color="0.6", ms=3)
    axes.scatter(
        across[known],
        twist[known],
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
        label = f"sample {number}" + ("" if shared else f"\n{limit_text(limit, load.unit)}")
        where = axes.get_xaxis_transform()
        axes.text(strip.middle(number), 1.02, label, transform=where, ha="center", va="bottom", fontsize=9)
    return top
