"""Predicted against measured loads."""

from __future__ import annotations

import pandas as pd
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, legend_below, source
from freelearn.render.palette import COLORS
from freelearn.results.parity import SPLITS, parity_ends
from freelearn.results.residuals import LOADS

MARKS = ("circle", "triangle", "square")
PLACE = [
    ("sample", "@sample"),
    ("elongation", "@elongation_mm mm"),
    ("twist", "@twist_deg°"),
    ("pressure", "@pressure_kpa kPa"),
]


def parity_charts(shown: pd.DataFrame) -> list[figure]:
    """Force and moment, by split, with the line of a perfect model. shown: of results.parity.parity_numbers."""
    panels = []
    for number, load in enumerate(LOADS):
        panel = chart("", f"measured {load.label}", f"predicted {load.label}", 480, 400)
        for split, mark, color in zip(SPLITS, MARKS, COLORS, strict=False):
            part = shown[shown["split"] == split]
            if not len(part):
                continue
            marks = panel.scatter(
                load.column, load.predicted, source=source(part), marker=mark, size=4, color=color, fill_alpha=0.2,
                legend_label=split,
            )  # fmt: skip
            hover(panel, [*PLACE, ("measured", f"@{load.column}"), ("predicted", f"@{load.predicted}")], [marks])
        if len(shown):
            ends = parity_ends(shown)[number]
            panel.line(ends, ends, color="black", legend_label="perfect")
            legend_below(panel)
        panels.append(panel)
    return panels
