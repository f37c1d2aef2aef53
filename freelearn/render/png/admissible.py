"""Which states an actuator reaches without buckling."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from freelearn.measurements.states import kinematic_state
from freelearn.render.png.canvas import heading, new_figure
from freelearn.render.png.cells import Cells
from freelearn.render.png.residual_map import MOST_SAMPLES
from freelearn.results.states import places

SCALE = "viridis"


def admissible_table(table: pd.DataFrame) -> pd.DataFrame:
    """Each kinematic state's place, its number of rows and the share of them that did not buckle.

    Columns sample, elongation_mm, twist_deg, rows, share."""
    state = kinematic_state(table)
    kept = (table["buckled"].reset_index(drop=True) == 0).groupby(state).agg(["size", "mean"])
    kept.columns = pd.Index(["rows", "share"])
    return places(table).join(kept.rename_axis("state")).reset_index(drop=True)


def admissible(table: pd.DataFrame, simulated: bool) -> Figure:
    """One cell per sample, up to eight in a row: share of a state's pressure steps without buckling."""
    states = admissible_table(table)
    samples = np.sort(table["sample"].unique())[:MOST_SAMPLES]
    cells = Cells(states[states["sample"].isin(samples)], samples)
    figure = new_figure(min(14.0, 3.5 + 1.6 * len(samples)), 4.0)
    figure.suptitle(heading("Admissible data: share of pressure steps without buckling", simulated), fontsize=11)
    width = figure.get_figwidth()
    axes = figure.add_axes((0.75 / width, 0.14, 1 - 2.0 / width, 0.66))
    axes.scatter(
        cells.across(), cells.states["twist_deg"], c=cells.states["share"], cmap=SCALE, vmin=0, vmax=1,
        s=cells.marker_area(axes), marker="s",
    )  # fmt: skip
    cells.frame(axes, bottom=True)
    whole = table.groupby("sample")["buckled"].apply(lambda buckled: (buckled == 0).mean())
    for number in samples:
        where = axes.get_xaxis_transform()
        text = f"sample {number}\n{100 * whole[number]:.0f} %"
        axes.text(cells.middle(number), 1.02, text, transform=where, ha="center", va="bottom", fontsize=9)
    bar = figure.add_axes((1 - 1.13 / width, 0.14, 0.15 / width, 0.66))
    figure.colorbar(ScalarMappable(Normalize(0, 1), SCALE), cax=bar, label="share without buckling [1]")
    return figure
