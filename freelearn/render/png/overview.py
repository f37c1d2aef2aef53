"""Peak performance, generalization and size of the models of a sweep."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from freelearn.render.palette import COLORS
from freelearn.render.png.canvas import heading, new_figure
from freelearn.render.png.heatmap import TICKS

# Names of models side by side under the overview.
NAMES_IN_A_ROW = 4


def overview(summary: pd.DataFrame, simulated: bool) -> Figure:
    """Peak performance against generalization, and error against the number of parameters, one mark per label."""
    # Names stand below: beside the marks they would lie on each other.
    rows = -(-len(summary) // NAMES_IN_A_ROW)
    height = 4.3 + 0.22 * rows
    figure = new_figure(10.0, height)
    figure.suptitle(heading("Peak performance, generalization and size of the models", simulated), fontsize=11)
    figure.subplots_adjust(left=0.075, right=0.98, bottom=(0.62 + 0.22 * rows) / height, top=0.88, wspace=0.25)
    panels = (
        ("diagonal", "E on the training set's own test rows [%]", 100.0),
        ("parameters", "number of fitted parameters", 1.0),
    )
    for number, (column, label, factor) in enumerate(panels, 1):
        axes = figure.add_subplot(1, 2, number)
        for i, (_, row) in enumerate(summary.iterrows()):
            x = factor * row[column]
            color, marker = COLORS[i % len(COLORS)], "osD^vP*X"[i % 8]
            # Open marks over filled ones, larger: where both lie on one place both are seen.
            for which, fill in (("unseen", color), ("diagonal", "none")):
                if number == 1 and which == "diagonal":
                    continue
                name = row["label"] if number == 1 else None
                size = 8 if which == "unseen" else 11
                axes.plot(x, 100 * row[which], marker, color=color, mfc=fill, ms=size, mew=1.6, label=name, alpha=0.85)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(FixedLocator(TICKS))
            axis.set_minor_locator(NullLocator())
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        if number == 2:
            axes.xaxis.set_major_locator(FixedLocator(sorted(summary[column].dropna().unique())))
        axes.margins(0.2)
        axes.grid(alpha=0.25, which="both", linewidth=0.6)
        axes.set_xlabel(label)
        axes.set_ylabel("E [%]" if number == 2 else "E on samples never trained on [%]")
        if number == 2:
            axes.set_title("filled: samples never trained on; open: the training set's own test rows", fontsize=8.5)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="lower center", ncols=min(len(labels), NAMES_IN_A_ROW), frameon=False, fontsize=9
    )
    return figure
