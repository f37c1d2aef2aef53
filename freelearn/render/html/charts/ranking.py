"""How much each effect would explain."""

from __future__ import annotations

import pandas as pd
from bokeh.plotting import figure

from freelearn.inference.thresholds import ALPHA
from freelearn.render.html.charts.canvas import chart, hover, legend_below, source
from freelearn.render.palette import COLORS


def ranking_chart(table: pd.DataFrame) -> figure:
    """Bars by size, filled where chance is ruled out. table: of results.ranking.ranking_numbers."""
    names = table["effect"].tolist()[::-1]
    panel = chart(
        "what each effect would explain",
        "size of the effect after refitting [σ], logarithmic",
        "",
        620,
        120 + 20 * len(names),
        y_range=names,
        x_axis_type="log",
    )
    shown = table.assign(shown=table["size"].clip(lower=0.06), percent=100 * table["E_heldout"])
    certain = table["p_value"] <= ALPHA
    for part, fill, label in ((certain, 0.9, f"p ≤ {ALPHA:g}"), (~certain, 0.05, "may be chance")):
        if part.any():
            bars = panel.hbar(
                y="effect", left=0.05, right="shown", height=0.65, source=source(shown[part]), color=COLORS[0],
                fill_alpha=fill, legend_label=label,
            )  # fmt: skip
            tips = [("effect", "@effect"), ("size", "@size{0.0} σ"), ("p by chance", "@p_value{0.000}")]
            hover(panel, [*tips, ("E held-out", "@percent{0.000} %")], [bars])
    panel.x_range.start = 0.05
    if len(table):
        legend_below(panel)
    return panel
