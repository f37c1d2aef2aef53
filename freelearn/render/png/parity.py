"""Predicted against measured loads."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from freelearn.models.predicted import usable
from freelearn.render.png.canvas import COLORS, finish, heading, new_figure

LOADS = (("force_n", "force_pred_n", "force F [N]"), ("moment_nmm", "moment_pred_nmm", "moment M [N·mm]"))
MARKERS = {"train": "o", "validation": "^", "test": "s"}
# More points than this per split only darken the picture.
SHOWN = 3000


def parity(predictions: pd.DataFrame, title: str, simulated: bool) -> Figure:
    """Two panels, force and moment: usable rows by split, and the line on which a perfect model would lie.

    predictions: columns of predictions.csv.
    """
    rows = usable(predictions)
    figure = new_figure(9.5, 4.6)
    figure.suptitle(heading(title, simulated))
    figure.subplots_adjust(left=0.09, right=0.98, bottom=0.13, top=0.88, wspace=0.28)
    for panel, (measured, predicted, label) in enumerate(LOADS, 1):
        axes = figure.add_subplot(1, 2, panel)
        for (split, marker), color in zip(MARKERS.items(), COLORS, strict=False):
            part = rows[rows["split"] == split]
            if len(part):
                name = split if len(part) <= SHOWN else f"{split} ({SHOWN} of {len(part)} shown)"
                part = thinned(part)
                axes.plot(part[measured], part[predicted], marker, color=color, ms=3.5, mfc="none", mew=0.7, label=name)
        if len(rows):
            both = rows[[measured, predicted]].to_numpy()
            ends = np.array([both.min(), both.max()])
            axes.plot(ends, ends, "-", color="black", linewidth=1, label="perfect")
        finish(axes, f"measured {label}", f"predicted {label}")
        axes.legend(frameon=False, fontsize=8)
    return figure


def thinned(part: pd.DataFrame) -> pd.DataFrame:
    """At most SHOWN rows, the same ones each time.

    Drawn at random: every n-th row could fall on the same pressure step of every state.
    """
    if len(part) <= SHOWN:
        return part
    return part.iloc[np.sort(np.random.default_rng(0).choice(len(part), SHOWN, replace=False))]
