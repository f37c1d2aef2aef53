"""Predicted against measured quantities."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from bokeh.plotting import figure

from freelearn.measurements.beds import Quantity
from freelearn.render.html.charts.canvas import chart, hover, legend_below, source
from freelearn.render.palette import COLORS
from freelearn.results.curve_panels import LOOSE
from freelearn.results.parity import SPLITS, loose_rows, parity_ends

MARKS = ("circle", "triangle", "square")


def parity_charts(shown: pd.DataFrame, quantities: Sequence[Quantity], imposed: Sequence[Quantity]) -> list[figure]:
    """Force and moment, or what else was measured, by split, with the line of a perfect model. shown: of
    results.parity.parity_numbers; imposed: what stands under the mouse besides."""
    place = [("sample", "@sample"), *((f"{q.name} {q.symbol}", f"@{q.column}{q.suffix}") for q in imposed)]
    panels = []
    loose = shown[loose_rows(shown)]
    shown = shown[~loose_rows(shown)]
    for number, load in enumerate(quantities):
        tips = [*place, ("measured", f"@{load.column}"), ("predicted", f"@{load.predicted}")]
        panel = chart("", f"measured {load.label}", f"predicted {load.label}", 430, 380)
        for split, mark, color in zip(SPLITS, MARKS, COLORS, strict=False):
            part = shown[shown["split"] == split]
            if not len(part):
                continue
            marks = panel.scatter(
                load.column, load.predicted, source=source(part), marker=mark, size=4, color=color, fill_alpha=0.2,
                legend_label=split,
            )  # fmt: skip
            hover(panel, tips, [marks])
        if len(loose):
            marks = panel.scatter(
                load.column, load.predicted, source=source(loose), marker="diamond", size=7, color="#666666",
                fill_alpha=0.0, legend_label=LOOSE,
            )  # fmt: skip
            hover(panel, tips, [marks])
        if len(shown):
            ends = parity_ends(shown, quantities)[number]
            panel.line(ends, ends, color="black", legend_label="perfect")
            legend_below(panel)
        panels.append(panel)
    return panels
