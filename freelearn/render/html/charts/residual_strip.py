"""Where over length and twist a model is wrong, several samples side by side: one chart each for force and moment."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from bokeh.models import ColorBar, LinearColorMapper
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, source
from freelearn.render.html.charts.residuals import NOTHING, PALETTE, TIPS
from freelearn.results.residuals import LOADS, limit_text, scale_end
from freelearn.results.strip import Strip, spacing

ACROSS = "elongation [mm], samples side by side; each one's number and limit"


def residual_strips(table: pd.DataFrame, samples: Sequence[int]) -> list[figure]:
    """table: of residual_table; samples: those shown. They differ a hundredfold in load, so each has its own scale,
    written under it."""
    table = table[table["sample"].isin(samples)]
    strip = Strip(table, samples)
    wide, high = spacing(table["elongation_mm"]), spacing(table["twist_deg"])
    table = table.assign(across=strip.across(), wide=wide, high=high)
    ticks = [strip.middle(n) for n in samples]
    panels = []
    for load in LOADS:
        limits = {n: scale_end(table.loc[table["sample"] == n, load.column]) for n in samples}
        shown = table.assign(share=table[load.column] / table["sample"].map(limits))
        title = f"{load.name}: measured − predicted, as a share of each sample's limit"
        panel = chart(title, ACROSS, "twist [deg]", 1240, 300)
        mapper = LinearColorMapper(PALETTE, low=-1, high=1, nan_color=NOTHING)
        squares = panel.rect(
            "across", "twist_deg", "wide", "high", source=source(shown), line_color=None,
            fill_color={"field": "share", "transform": mapper},
        )  # fmt: skip
        hover(panel, [("sample", "@sample"), *TIPS], [squares])
        panel.xaxis.ticker = ticks
        panel.xaxis.major_label_overrides = {
            tick: f"{n}: {limit_text(limits[n], load.unit)}" for tick, n in zip(ticks, samples, strict=True)
        }
        panel.xgrid.visible = False
        panel.add_layout(ColorBar(color_mapper=mapper, title="share", width=10, padding=4), "right")
        panels.append(panel)
    return panels
