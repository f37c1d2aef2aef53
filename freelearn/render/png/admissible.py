"""Which states an actuator reaches without buckling."""

from __future__ import annotations

import pandas as pd
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from freelearn.render.png.canvas import heading, new_figure
from freelearn.render.png.fields import frame, marker_area
from freelearn.results.admissible import admissible_table, sample_shares
from freelearn.results.quantities import plane
from freelearn.results.residuals import shown_samples
from freelearn.results.strip import Strip

SCALE = "viridis"


def admissible(table: pd.DataFrame, simulated: bool) -> Figure:
    """One field per sample, up to eight in a row: share of a state's pressure steps without buckling."""
    over = plane(table)
    states = admissible_table(table, over)
    samples, _ = shown_samples(table)
    strip = Strip(states[states["sample"].isin(samples)], samples, over)
    figure = new_figure(min(14.0, 3.5 + 1.6 * len(samples)), 4.0)
    figure.suptitle(heading("Admissible data: share of pressure steps without buckling", simulated), fontsize=11)
    width = figure.get_figwidth()
    axes = figure.add_axes((0.75 / width, 0.14, 1 - 2.0 / width, 0.66))
    axes.scatter(
        strip.across(), strip.up(), c=strip.states["share"], cmap=SCALE, vmin=0, vmax=1,
        s=marker_area(strip, axes), marker="s",
    )  # fmt: skip
    frame(strip, axes, bottom=True)
    whole = sample_shares(table)
    for number in samples:
        where = axes.get_xaxis_transform()
        text = f"sample {number}\n{100 * whole[number]:.0f} %"
        axes.text(strip.middle(number), 1.02, text, transform=where, ha="center", va="bottom", fontsize=9)
    bar = figure.add_axes((1 - 1.13 / width, 0.14, 0.15 / width, 0.66))
    figure.colorbar(ScalarMappable(Normalize(0, 1), SCALE), cax=bar, label="share without buckling [1]")
    return figure
