"""How alike the effects' traces are in these data."""

from __future__ import annotations

import numpy as np
import pandas as pd
from bokeh.models import ColorBar, LinearColorMapper
from bokeh.palettes import Viridis256
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, source
from freelearn.results.likeness import TWINS

# Pixels of a cell, and of the names beside the cells.
CELL, NAMES = 17, 170


def likeness_chart(table: pd.DataFrame) -> figure:
    """Every effect against every other, dark where they look alike. table: of results.likeness.likeness_table."""
    names = table["effect"].tolist()
    cosine = table[names].to_numpy(dtype=np.float64)
    side = CELL * len(names) + NAMES
    panel = chart("", "", "", side + 70, side, x_range=names, y_range=names[::-1])
    one, other = np.meshgrid(names, names, indexing="ij")
    mark = np.where((cosine > TWINS) & (one != other), "=", "")
    columns = {"one": one.ravel(), "other": other.ravel(), "cosine": cosine.ravel(), "mark": mark.ravel()}
    cells = source(pd.DataFrame(columns))
    mapper = LinearColorMapper(Viridis256[::-1], low=0, high=1)
    squares = panel.rect(
        "other", "one", 1, 1, source=cells, line_color=None, fill_color={"field": "cosine", "transform": mapper}
    )
    panel.text(
        "other", "one", text="mark", source=cells, text_color="white", text_align="center", text_baseline="middle",
        text_font_size="8pt", text_font_style="bold",
    )  # fmt: skip
    hover(panel, [("effects", "@one, @other"), ("cosine", "@cosine{0.00}")], [squares])
    panel.xaxis.major_label_orientation = 1.0
    panel.grid.visible = False
    panel.add_layout(ColorBar(color_mapper=mapper, title="cosine", width=10, padding=4), "right")
    return panel
