"""Predicted against measured quantities."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from freelearn.measurements.beds import Quantity
from freelearn.render.palette import COLORS
from freelearn.render.png.canvas import finish, heading, new_figure
from freelearn.results.curve_panels import LOOSE
from freelearn.results.parity import SPLITS, loose_rows, parity_ends, parity_numbers, split_labels
from freelearn.results.quantities import told

MARKERS = ("o", "^", "s")


def parity(predictions: pd.DataFrame, title: str, simulated: bool) -> Figure:
    """A panel each for force and moment, or what else was measured: usable rows by split, those of a tube that hangs
    loose apart, and the line on which a perfect model would lie.

    predictions: columns of predictions.csv.
    """
    quantities = told(predictions)
    width = 4.75 * len(quantities)
    figure = new_figure(width, 4.6)
    figure.suptitle(heading(title, simulated))
    figure.subplots_adjust(left=0.855 / width, right=1 - 0.19 / width, bottom=0.13, top=0.88, wspace=0.28)
    panels = [figure.add_subplot(1, len(quantities), panel + 1) for panel in range(len(quantities))]
    draw_parity(panels, predictions, quantities)
    return figure


def draw_parity(panels: Sequence[Axes], predictions: pd.DataFrame, quantities: Sequence[Quantity]) -> None:
    """Draws one quantity on each of the axes. predictions, quantities: as of `parity`."""
    shown, labels = parity_numbers(predictions), split_labels(predictions)
    loose = shown[loose_rows(shown)]
    shown = shown[~loose_rows(shown)]
    for axes, load in zip(panels, quantities, strict=True):
        for split, marker, color in zip(SPLITS, MARKERS, COLORS, strict=False):
            if split in labels:
                part = shown[shown["split"] == split]
                axes.plot(
                    part[load.column], part[load.predicted], marker, color=color, ms=3.5, mfc="none", mew=0.7,
                    label=labels[split],
                )  # fmt: skip
        if len(loose):
            axes.plot(loose[load.column], loose[load.predicted], "d", color="0.4", ms=4.5, mfc="none", label=LOOSE)
        if len(shown):
            (ends,) = parity_ends(shown, [load])
            axes.plot(ends, ends, "-", color="black", linewidth=1, label="perfect")
        finish(axes, f"measured {load.label}", f"predicted {load.label}")
        axes.legend(frameon=False, fontsize=8)
