"""Where over length and twist a model is wrong, several samples side by side: one chart each for force and moment."""

from __future__ import annotations

import pandas as pd
from bokeh.models import ColorBar, LinearColorMapper
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, source, symmetric
from freelearn.render.html.charts.residuals import NOTHING, PALETTE, spacing
from freelearn.render.png.cells import Cells
from freelearn.render.png.residual_map import LOADS


def residual_strips(table: pd.DataFrame) -> list[figure]:
    """table: of residual_table. Samples differ a hundredfold in load, so each has its own scale, written above it."""
    samples = [int(n) for n in sorted(table["sample"].unique())]
    cells = Cells(table, samples)
    wide, high = spacing(table["elongation_mm"]), spacing(table["twist_deg"])
    table = table.assign(across=cells.across(), wide=wide, high=high)
    ticks = [cells.middle(n) for n in samples]
    panels = []
    for column, _, name, unit in LOADS:
        limits = {n: symmetric(table.loc[table["sample"] == n, column]) for n in samples}
        shown = table.assign(share=table[column] / table["sample"].map(limits))
        title = f"{name}: measured − predicted, as a share of each sample's limit"
        across = "elongation [mm], samples side by side; each one's number and limit"
        panel = chart(title, across, "twist [deg]", 1240, 300)
        mapper = LinearColorMapper(PALETTE, low=-1, high=1, nan_color=NOTHING)
        squares = panel.rect(
            "across", "twist_deg", "wide", "high", source=source(shown), line_color=None,
            fill_color={"field": "share", "transform": mapper},
        )  # fmt: skip
        tips = [("sample", "@sample"), ("elongation", "@elongation_mm{0.[000]} mm"), ("twist", "@twist_deg{0.[00]}°")]
        tips += [("force", "@force_n{0.[000]} N"), ("moment", "@moment_nmm{0.[0]} N·mm"), ("rows", "@rows")]
        hover(panel, tips, [squares])
        panel.xaxis.ticker = ticks
        panel.xaxis.major_label_overrides = {
            tick: f"{n}: ± {float(f'{limits[n]:.2g}'):g} {unit}" for tick, n in zip(ticks, samples, strict=True)
        }
        panel.xgrid.visible = False
        panel.add_layout(ColorBar(color_mapper=mapper, title="share", width=10, padding=4), "right")
        panels.append(panel)
    return panels
