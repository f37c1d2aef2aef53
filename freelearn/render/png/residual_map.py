"""Where over length and twist a model is wrong."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from freelearn.measurements.states import kinematic_state
from freelearn.models.predicted import usable
from freelearn.render.png.canvas import heading, new_figure
from freelearn.render.png.cells import Cells
from freelearn.results.states import places

LOADS = (("force_n", "force_pred_n", "force", "N"), ("moment_nmm", "moment_pred_nmm", "moment", "N·mm"))
# Diverging, and light in the middle: the sign survives colour blindness, the size survives greyscale.
SCALE = "PuOr"
MOST_SAMPLES = 8
Place = tuple[float, float, float, float]


def residual_table(predictions: pd.DataFrame) -> pd.DataFrame:
    """Each kinematic state's place and, over its usable rows, mean measured − predicted force [N] and moment [N·mm]
    (blank without one) and their number `rows`. Columns sample, elongation_mm, twist_deg, force_n, moment_nmm, rows."""
    predictions = predictions.reset_index(drop=True)
    state = pd.Series(kinematic_state(predictions))
    rows = usable(predictions)
    residual = pd.DataFrame({name: rows[name] - rows[predicted] for name, predicted, *_ in LOADS})
    grouped = residual.groupby(state[rows.index])
    means = grouped.mean().assign(rows=grouped.size()).rename_axis("state")
    return places(predictions).join(means).fillna({"rows": 0}).reset_index(drop=True)


def residual_map(predictions: pd.DataFrame, title: str, simulated: bool) -> Figure:
    """A cell per sample, a row each for force and moment: mean residual over pressure at each length and twist.

    Scales are symmetric about zero. Each cell has its own, written above it, because samples differ a hundredfold in
    load. Grey dots are states without a usable row. The two rows lie side by side where there is one sample.
    predictions: columns of predictions.csv.
    """
    present = np.sort(predictions["sample"].unique())
    samples = present[:MOST_SAMPLES]
    alone = len(samples) <= 1
    cells = Cells(residual_table(predictions[predictions["sample"].isin(samples)]), samples)
    figure = new_figure(10.2, 4.4) if alone else new_figure(min(14.0, 3.5 + 1.6 * len(samples)), 6.4, dpi=80)
    note = f", first {len(samples)} of {len(present)} samples" if len(present) > len(samples) else ""
    figure.suptitle(heading(title, simulated) + f"\nmeasured − predicted, mean over pressure{note}", fontsize=11)
    for number, (load, place) in enumerate(zip(LOADS, _places(figure, alone), strict=True)):
        axes = figure.add_axes(place)
        cells.frame(axes, bottom=alone or number == 1)
        top = _draw(axes, cells, load, alone)
        if alone:
            _colorbar(figure, place, top, f"{load[2]} residual [{load[3]}]")
        elif number == 1:
            # Cells with scales of their own have one bar for both rows: colours there are shares of the cell's limit.
            both = (place[0], place[1], place[2], 0.85 - place[1])
            _colorbar(figure, both, top, "residual [share of the ± limit above its cell]")
    return figure


def _places(figure: Figure, alone: bool) -> list[Place]:
    """Left, bottom, width and height of the two rows' axes; they leave room in inches for labels and colourbars."""
    width = figure.get_figwidth()
    left, bar = 0.75 / width, 1.05 / width
    if alone:
        each = (1 - 2 * (left + bar)) / 2
        return [(left, 0.14, each, 0.66), (2 * left + each + bar, 0.14, each, 0.66)]
    return [(left, 0.53, 1 - left - bar, 0.32), (left, 0.09, 1 - left - bar, 0.32)]


def _colorbar(figure: Figure, place: Place, top: float, label: str) -> None:
    """A bar to the right of `place`. Placed by hand: matplotlib's placing takes room from the cells."""
    left, bottom, width, height = place
    inch = 1 / figure.get_figwidth()
    axes = figure.add_axes((left + width + 0.12 * inch, bottom, 0.15 * inch, height))
    ticks = MaxNLocator(4, symmetric=True)
    figure.colorbar(ScalarMappable(Normalize(-top, top), SCALE), cax=axes, label=label, ticks=ticks)


def _draw(axes: Axes, cells: Cells, load: tuple[str, str, str, str], shared: bool) -> float:
    """All samples' states coloured by one load's residual; returns the end of the colour scale."""
    name, _, _, unit = load
    residual, sample = cells.states[name], cells.states["sample"]
    largest = residual.abs().groupby(sample).max()
    limits = {number: _limit(largest[number]) for number in cells.samples}
    color, top = (residual, _limit(residual.abs().max())) if shared else (residual / sample.map(limits), 1.0)
    across, twist, known = cells.across(), cells.states["twist_deg"], residual.notna()
    axes.plot(across[~known], twist[~known], ".", color="0.6", ms=3)
    axes.scatter(
        across[known],
        twist[known],
        c=color[known],
        cmap=SCALE,
        vmin=-top,
        vmax=top,
        s=cells.marker_area(axes),
        marker="s",
        # A residual of zero is nearly white: without an edge it would look like a missing state.
        edgecolors="0.6",
        linewidths=0.3,
    )
    for number, limit in limits.items():
        label = f"sample {number}" + ("" if shared else f"\n± {float(f'{limit:.2g}'):g} {unit}")
        where = axes.get_xaxis_transform()
        axes.text(cells.middle(number), 1.02, label, transform=where, ha="center", va="bottom", fontsize=9)
    return top


def _limit(largest: float) -> float:
    """The end of a colour scale for residuals up to `largest`; 1 where there is none, so that a scale exists."""
    return float(largest) if largest > 0 else 1.0
