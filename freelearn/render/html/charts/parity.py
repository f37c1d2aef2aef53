"""Predicted against measured loads."""

from __future__ import annotations

import numpy as np
import pandas as pd
from bokeh.plotting import figure

from freelearn.models.predicted import usable
from freelearn.render.html.charts.canvas import COLORS, chart, hover, legend_below, source
from freelearn.render.png.parity import LOADS, thinned

MARKS = {"train": "circle", "validation": "triangle", "test": "square"}
COLUMNS = ["sample", "elongation_mm", "twist_deg", "pressure_kpa", "split"]


def parity_numbers(predictions: pd.DataFrame) -> pd.DataFrame:
    """The rows shown: usable ones, at most 3,000 of each split."""
    rows = usable(predictions)
    loads = [name for measured, predicted, _ in LOADS for name in (measured, predicted)]
    parts = [thinned(rows[rows["split"] == split]) for split in MARKS]
    return pd.concat(parts)[[*COLUMNS, *loads]].reset_index(drop=True)


def parity_charts(shown: pd.DataFrame) -> list[figure]:
    """Force and moment, by split, with the line of a perfect model. shown: of parity_numbers."""
    panels = []
    for measured, predicted, label in LOADS:
        panel = chart("", f"measured {label}", f"predicted {label}", 480, 400)
        for (split, mark), color in zip(MARKS.items(), COLORS, strict=False):
            part = shown[shown["split"] == split]
            if not len(part):
                continue
            marks = panel.scatter(
                measured,
                predicted,
                source=source(part),
                marker=mark,
                size=4,
                color=color,
                fill_alpha=0.2,
                legend_label=split,
            )
            place = [("sample", "@sample"), ("elongation", "@elongation_mm mm"), ("twist", "@twist_deg°")]
            loads = [("pressure", "@pressure_kpa kPa"), ("measured", f"@{measured}"), ("predicted", f"@{predicted}")]
            hover(panel, place + loads, [marks])
        if len(shown):
            both = shown[[measured, predicted]].to_numpy()
            ends = [np.nanmin(both), np.nanmax(both)]
            panel.line(ends, ends, color="black", legend_label="perfect")
            legend_below(panel)
        panels.append(panel)
    return panels
