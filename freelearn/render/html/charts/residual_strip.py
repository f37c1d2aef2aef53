"""Where over what is imposed a model is wrong, several samples side by side: one chart for each quantity."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from bokeh.models import ColorBar, LinearColorMapper
from bokeh.plotting import figure

from freelearn.measurements.beds import Pair, Quantity
from freelearn.render.html.charts.canvas import chart, hover, source
from freelearn.render.html.charts.residuals import NOTHING, PALETTE, tips
from freelearn.results.formats import DASH
from freelearn.results.residuals import Limits, limit_text
from freelearn.results.strip import Strip, spacing

ACROSS = "samples side by side; each one's number and limit"


def residual_strips(
    table: pd.DataFrame, samples: Sequence[int], plane: Pair, quantities: Sequence[Quantity], ends: Limits
) -> list[figure]:
    """table: of residual_table over the plane; samples: those shown. They differ a hundredfold in load, so each has its
    own scale, whose end, one of `ends`, is written under it."""
    table = table[table["sample"].isin(samples)]
    strip = Strip(table, samples, plane)
    wide, high = (spacing(table[quantity.column]) for quantity in plane)
    table = table.assign(across=strip.across(), wide=wide, high=high)
    ticks = [strip.middle(n) for n in samples]
    # Whole parts: the middle of the first, where its number stands, may lie left of all its marks.
    across = (strip.low - wide / 2, strip.low + strip.width * len(samples) + wide / 2)
    panels = []
    for load in quantities:
        limits = {n: ends[n, load.column] for n in samples}
        shown = table.assign(share=table[load.column] / table["sample"].map(limits))
        known = set(table.loc[table[load.column].notna(), "sample"])
        title = f"{load.name}: measured − predicted, as a share of each sample's limit"
        panel = chart(title, f"{strip.x.label}, {ACROSS}", strip.y.label, 1240, 300, x_range=across)
        mapper = LinearColorMapper(PALETTE, low=-1, high=1, nan_color=NOTHING)
        squares = panel.rect(
            "across", strip.y.column, "wide", "high", source=source(shown), line_color=None,
            fill_color={"field": "share", "transform": mapper},
        )  # fmt: skip
        hover(panel, [("sample", "@sample"), *tips(plane, quantities)], [squares])
        panel.xaxis.ticker = ticks
        panel.xaxis.major_label_overrides = {
            tick: f"{n}: {limit_text(limits[n], load.unit) if n in known else DASH}"
            for tick, n in zip(ticks, samples, strict=True)
        }
        panel.xgrid.visible = False
        panel.add_layout(ColorBar(color_mapper=mapper, title="share", width=10, padding=4), "right")
        panels.append(panel)
    return panels
