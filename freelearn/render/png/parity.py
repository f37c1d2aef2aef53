"""Predicted against measured loads."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from freelearn.render.palette import COLORS
from freelearn.render.png.canvas import finish, heading, new_figure
from freelearn.results.parity import SPLITS, parity_ends, parity_numbers, split_labels
from freelearn.results.residuals import LOADS

MARKERS = ("o", "^", "s")


def parity(predictions: pd.DataFrame, title: str, simulated: bool) -> Figure:
    """Two panels, force and moment: usable rows by split, and the line on which a perfect model would lie.

    predictions: columns of predictions.csv.
    """
    shown, labels = parity_numbers(predictions), split_labels(predictions)
    figure = new_figure(9.5, 4.6)
    figure.suptitle(heading(title, simulated))
    figure.subplots_adjust(left=0.09, right=0.98, bottom=0.13, top=0.88, wspace=0.28)
    for panel, load in enumerate(LOADS):
        axes = figure.add_subplot(1, 2, panel + 1)
        for split, marker, color in zip(SPLITS, MARKERS, COLORS, strict=False):
            if split in labels:
                part = shown[shown["split"] == split]
                axes.plot(
                    part[load.column], part[load.predicted], marker, color=color, ms=3.5, mfc="none", mew=0.7,
                    label=labels[split],
                )  # fmt: skip
        if len(shown):
            ends = parity_ends(shown)[panel]
            axes.plot(ends, ends, "-", color="black", linewidth=1, label="perfect")
        finish(axes, f"measured {load.label}", f"predicted {load.label}")
        axes.legend(frameon=False, fontsize=8)
    return figure
