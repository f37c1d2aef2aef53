"""Predicted against measured, and the function that a proposal says."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from bokeh.models import Span
from bokeh.plotting import figure

from freelearn.common.display import COLORS
from freelearn.data.beds import Quantity
from freelearn.queries.curves.curve_panels import LOOSE
from freelearn.records.written_effects import ProposalCurve
from freelearn.report.html.chart_canvas import chart, hover, legend_below, source
from freelearn.report.tables.picture_numbers import SPLITS, loose_rows, parity_ends

MARKS = ("circle", "triangle", "square")


def parity_charts(shown: pd.DataFrame, quantities: Sequence[Quantity], imposed: Sequence[Quantity]) -> list[figure]:
    """Force and moment, or what else was measured, by split, with the line of a perfect model. shown: of
    picture_numbers.parity_numbers; imposed: what stands under the mouse besides. None where no row has an answer."""
    if shown.empty:
        return []
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


def proposal_chart(curve: ProposalCurve) -> figure:
    """A line for the form; a dashed line and its 95 % band for a free function at the same place."""
    panel = chart(curve.title, curve.x, curve.y, 560, 360)
    data, x = source(curve.numbers), str(curve.numbers.columns[0])
    panel.varea(
        x=x, y1="low", y2="high", source=data, fill_color="#999999", fill_alpha=0.35,
        legend_label="free function, 95 % band",
    )  # fmt: skip
    line = panel.line(x=x, y="form", source=data, color=COLORS[0], width=3, alpha=0.8, legend_label="closed form")
    # Above the form, which it lies on where nothing else is asked for.
    panel.line(x=x, y="free", source=data, color="black", line_dash="dashed", legend_label="free function")
    panel.add_layout(Span(location=0.0, dimension="width", line_width=0.7))
    hover(panel, [(curve.x, f"@{{{x}}}"), ("form", "@form"), ("free", "@free"), ("band", "@low … @high")], [line])
    legend_below(panel)
    return panel
