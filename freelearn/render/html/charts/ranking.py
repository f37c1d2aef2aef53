"""How much each effect would explain."""

from __future__ import annotations

import pandas as pd
from bokeh.models import BasicTickFormatter
from bokeh.plotting import figure

from freelearn.inference.thresholds import CLEAR
from freelearn.render.html.charts.canvas import chart, hover, legend_below, source
from freelearn.render.palette import COLORS
from freelearn.results.ranking import NO_MORE, STANDS_OUT

# A size of nothing still has a place on a logarithmic axis, the leftmost.
SMALLEST = 0.1


def ranking_chart(table: pd.DataFrame) -> figure:
    """Points by size, filled where chance is ruled out. table: of results.ranking.ranking_numbers."""
    names = table["effect"].tolist()[::-1]
    panel = chart(
        "what each effect would explain",
        "effect size after refitting [noise standard deviations], logarithmic",
        "",
        620,
        120 + 20 * len(names),
        y_range=names,
        x_axis_type="log",
    )
    # Points and not bars: on a logarithmic axis the length of a bar is as long as where the axis begins.
    shown = table.assign(shown=table["size"].clip(lower=SMALLEST), percent=100 * table["E_heldout"])
    certain = table["p_value"] <= CLEAR
    marks = ((certain, COLORS[0], STANDS_OUT), (~certain, "white", NO_MORE))
    for part, color, label in marks:
        if part.any():
            points = panel.scatter(
                "shown", "effect", source=source(shown[part]), marker="circle", size=10, line_color=COLORS[0],
                line_width=1.5, fill_color=color, legend_label=label,
            )  # fmt: skip
            tips = [("effect", "@effect"), ("size", "@size{0.0} σ"), ("p by chance", "@p_value{0.000}")]
            hover(panel, [*tips, ("E held-out", "@percent{0.000} %")], [points])
    panel.xaxis.formatter = BasicTickFormatter(use_scientific=False)
    panel.x_range.start = 0.8 * SMALLEST
    if len(table):
        legend_below(panel)
    return panel
