"""Where over length and twist a model is wrong."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from freelearn.plots.canvas import finish, heading, new_figure
from freelearn.plots.states import PLACE, usable

LOADS = (("force_n", "force_pred_n", "force [N]"), ("moment_nmm", "moment_pred_nmm", "moment [N·mm]"))
# Diverging, and light in the middle: the sign survives colour blindness, the size survives greyscale.
SCALE = "PuOr"
MOST_SAMPLES = 8


def residual_table(predictions: pd.DataFrame) -> pd.DataFrame:
    """Mean measured − predicted force [N] and moment [N·mm] of each kinematic state's usable rows."""
    rows = usable(predictions)
    residual = pd.DataFrame({name: rows[name] - rows[predicted] for name, predicted, _ in LOADS})
    return residual.groupby([rows[name] for name in PLACE]).mean().reset_index()


def residual_map(predictions: pd.DataFrame, title: str, simulated: bool) -> Figure:
    """A column per sample, a row each for force and moment: mean residual over pressure at each length and twist.

    Every panel has a scale of its own, symmetric about zero, because samples differ a hundredfold in load. Grey dots
    are states without a usable row. predictions: columns of predictions.csv.
    """
    table = residual_table(predictions)
    samples = np.sort(predictions["sample"].unique())[:MOST_SAMPLES]
    figure = new_figure(max(6.0, 2.6 * len(samples) + 1.0), 7.2, dpi=90)
    figure.suptitle(heading(title, simulated) + "\nmeasured − predicted, mean over pressure", fontsize=11)
    width = figure.get_figwidth()
    figure.subplots_adjust(left=0.75 / width, right=1 - 0.65 / width, bottom=0.08, top=0.88, wspace=0.5, hspace=0.3)
    for column, sample in enumerate(samples):
        everywhere = predictions.loc[predictions["sample"] == sample, PLACE[1:]].drop_duplicates()
        here = table[table["sample"] == sample]
        for row, (name, _, label) in enumerate(LOADS):
            axes = figure.add_subplot(len(LOADS), len(samples), row * len(samples) + column + 1)
            empty = everywhere.merge(here[PLACE[1:]], how="left", indicator=True).query("_merge == 'left_only'")
            axes.plot(empty["elongation_mm"], empty["twist_deg"], ".", color="0.75", ms=2)
            limit = max(here[name].abs().max(), 1e-12) if len(here) else 1.0
            points = axes.scatter(
                here["elongation_mm"],
                here["twist_deg"],
                c=here[name],
                cmap=SCALE,
                vmin=-limit,
                vmax=limit,
                s=26,
                marker="s",
            )
            bar = figure.colorbar(points, ax=axes, fraction=0.07, pad=0.03)
            bar.ax.tick_params(labelsize=7)
            finish(axes, "elongation [mm]" if row else "", "twist [deg]" if column == 0 else "")
            axes.set_title(f"sample {sample}: {label}", fontsize=9)
    return figure
