"""Residuals over what is imposed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from bokeh.models import ColorBar, ColumnDataSource, LinearColorMapper
from bokeh.palettes import interp_palette
from bokeh.plotting import figure

from freelearn.common.display import DIVERGING
from freelearn.common.formats import DASH
from freelearn.data.beds import KINEMATIC, Pair, Quantity
from freelearn.report.html.chart_canvas import chart, hover, source
from freelearn.report.tables.residual_tables import Limits, Strip, limit_text, scale_end, spacing

# Where over what is imposed a model is wrong: one chart for each quantity that was measured of one sample.

PALETTE = interp_palette(DIVERGING, 101)
NOTHING = "#cccccc"


def tips(plane: Pair, quantities: Sequence[Quantity]) -> list[tuple[str, str]]:
    """What stands under the mouse."""
    shown = [(f"{q.name} {q.symbol}", f"@{q.column}{{0.[000]}}{q.suffix}") for q in (*plane, *quantities)]
    return [*shown, ("rows", "@rows")]


class ResidualCharts:
    """Maps of force and moment, or what else was measured, over one set of states. Their data can be exchanged; a
    tapped cell is source.selected. plane: what is across and up."""

    def __init__(
        self,
        width: int = 420,
        height: int = 330,
        tap: bool = False,
        plane: Pair = KINEMATIC.state,
        quantities: Sequence[Quantity] = KINEMATIC.measured,
    ) -> None:
        self.plane, self.quantities = plane, quantities
        self.columns = [*(q.column for q in (*plane, *quantities)), "rows", "wide", "high"]
        self.source = ColumnDataSource({name: [] for name in self.columns})
        self.mappers, self.panels = [], []
        for load in quantities:
            mapper, panel = self._panel(load, width, height, tap)
            self.mappers.append(mapper)
            self.panels.append(panel)

    def _panel(self, load: Quantity, width: int, height: int, tap: bool) -> tuple[LinearColorMapper, figure]:
        x, y = self.plane
        panel = chart(f"{load.name}: measured − predicted [{load.unit}]", x.label, y.label, width, height)
        mapper = LinearColorMapper(PALETTE, low=-1, high=1, nan_color=NOTHING)
        cells = panel.rect(
            x.column,
            y.column,
            "wide",
            "high",
            source=self.source,
            fill_color={"field": load.column, "transform": mapper},
            # A residual of zero is nearly white: without an edge it would look like a missing state.
            line_color="#999999",
            line_width=0.5,
            nonselection_fill_alpha=1.0,
        )
        cells.selection_glyph = cells.glyph.clone()
        cells.selection_glyph.line_color, cells.selection_glyph.line_width = "black", 2.5
        hover(panel, tips(self.plane, self.quantities), [cells])
        if tap:
            panel.add_tools("tap")
        panel.add_layout(ColorBar(color_mapper=mapper, width=10, padding=4), "right")
        return mapper, panel

    def show(self, table: pd.DataFrame, limits: Sequence[float] | None = None) -> None:
        """table: one sample's rows of residual_table. limits: ends of the scales, force [N] and moment [N·mm]."""
        wide, high = (spacing(table[quantity.column]) for quantity in self.plane)
        table = table.assign(wide=wide, high=high)
        self.source.data = {name: table[name].to_numpy(dtype=np.float64) for name in self.columns}
        ends = limits or scales(table, self.quantities)
        for mapper, end in zip(self.mappers, ends, strict=True):
            mapper.low, mapper.high = -end, end


def scales(table: pd.DataFrame, quantities: Sequence[Quantity] = KINEMATIC.measured) -> tuple[float, ...]:
    """Ends of the force [N] and moment [N·mm] scales, or of other quantities', on which every residual shows."""
    return tuple(scale_end(table[quantity.column]) for quantity in quantities)


# Where over what is imposed a model is wrong, several samples side by side: one chart for each quantity.

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
