"""The error while a fit goes on."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from freelearn.plots.canvas import COLORS, finish, heading, new_figure


def history(frame: pd.DataFrame, title: str, simulated: bool) -> Figure:
    """Training and validation error by epoch. frame: epoch, train, validation (shares of the largest load)."""
    figure = new_figure(6.5, 4.0)
    figure.suptitle(heading(title, simulated))
    figure.subplots_adjust(left=0.13, right=0.97, bottom=0.15, top=0.87)
    axes = figure.add_subplot()
    for (name, color), style in zip((("train", COLORS[0]), ("validation", COLORS[1])), ("-", "--"), strict=True):
        axes.plot(frame["epoch"], 100 * frame[name], style, color=color, label=name)
    axes.set_yscale("log")
    finish(axes, "epoch", "error E [%]")
    axes.legend(frameon=False)
    return figure
