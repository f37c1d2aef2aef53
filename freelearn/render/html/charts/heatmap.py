"""Error of every training set (across) on every test set (down)."""

from __future__ import annotations

import pandas as pd
from bokeh.models import ColorBar, LogColorMapper
from bokeh.palettes import Viridis256
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, source
from freelearn.results.error_map import error_range, mean_text, set_order


def heatmap_chart(cells: pd.DataFrame, label: str) -> figure:
    """One label's map. cells: of summary.cells, of all labels: they share the order of sets and the color scale."""
    low, high = error_range(cells)
    across, down = set_order(cells["train"]), set_order(cells["test"])
    part = cells[(cells["label"] == label) & cells["E"].notna()]
    # The title has to fit above the narrowest.
    width, height = max(165 + 32 * len(across), 290), 130 + 30 * len(down)
    panel = chart(
        f"{label}: mean {mean_text(part)}", "training set", "test set", width, height,
        x_range=across, y_range=down[::-1],
    )  # fmt: skip
    # Small errors are bright.
    mapper = LogColorMapper(Viridis256[::-1], low=low, high=high)
    squares = panel.rect(
        "train", "test", 0.97, 0.97, source=source(part.assign(percent=100 * part["E"])),
        fill_color={"field": "percent", "transform": mapper}, line_color=None,
    )  # fmt: skip
    tips = [("trained on", "@train"), ("tested on", "@test"), ("E", "@percent{0.00} %"), ("seeds", "@seeds")]
    hover(panel, [*tips, ("rows scored", "@n{0}")], [squares])
    panel.xaxis.major_label_orientation = 1.0
    panel.grid.visible = False
    panel.add_layout(ColorBar(color_mapper=mapper, title="E [%]", width=10, padding=4), "right")
    return panel
