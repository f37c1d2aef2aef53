"""Where over length and twist a model is wrong: one chart each for force and moment of one sample."""

from __future__ import annotations

import numpy as np
import pandas as pd
from bokeh.models import ColorBar, ColumnDataSource, LinearColorMapper
from bokeh.palettes import interp_palette
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover
from freelearn.render.palette import DIVERGING
from freelearn.results.residuals import FORCE, LOADS, MOMENT, Load, scale_end
from freelearn.results.strip import spacing

PALETTE = interp_palette(DIVERGING, 101)
NOTHING = "#cccccc"
COLUMNS = ("elongation_mm", "twist_deg", "force_n", "moment_nmm", "rows", "wide", "high")
# What stands under the mouse.
TIPS = [
    ("elongation", "@elongation_mm{0.[000]} mm"),
    ("twist", "@twist_deg{0.[00]}°"),
    ("force", "@force_n{0.[000]} N"),
    ("moment", "@moment_nmm{0.[0]} N·mm"),
    ("rows", "@rows"),
]


class ResidualCharts:
    """Force and moment maps over one set of states. Their data can be exchanged; a tapped cell is source.selected."""

    def __init__(self, width: int = 420, height: int = 330, tap: bool = False) -> None:
        self.source = ColumnDataSource({name: [] for name in COLUMNS})
        self.mappers, self.panels = [], []
        for load in LOADS:
            mapper, panel = self._panel(load, width, height, tap)
            self.mappers.append(mapper)
            self.panels.append(panel)

    def _panel(self, load: Load, width: int, height: int, tap: bool) -> tuple[LinearColorMapper, figure]:
        panel = chart(f"{load.name}: measured − predicted", "elongation [mm]", "twist [deg]", width, height)
        mapper = LinearColorMapper(PALETTE, low=-1, high=1, nan_color=NOTHING)
        cells = panel.rect(
            "elongation_mm",
            "twist_deg",
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
        hover(panel, TIPS, [cells])
        if tap:
            panel.add_tools("tap")
        panel.add_layout(ColorBar(color_mapper=mapper, title=f"[{load.unit}]", width=10, padding=4), "right")
        return mapper, panel

    def show(self, table: pd.DataFrame, limits: tuple[float, float] | None = None) -> None:
        """table: one sample's rows of residual_table. limits: ends of the force [N] and moment [N·mm] scales."""
        wide, high = spacing(table["elongation_mm"]), spacing(table["twist_deg"])
        table = table.assign(wide=wide, high=high)
        self.source.data = {name: table[name].to_numpy(dtype=np.float64) for name in COLUMNS}
        ends = limits or scales(table)
        for mapper, end in zip(self.mappers, ends, strict=True):
            mapper.low, mapper.high = -end, end


def scales(table: pd.DataFrame) -> tuple[float, float]:
    """Ends of the force [N] and moment [N·mm] scales on which every residual of the table shows."""
    return scale_end(table[FORCE.column]), scale_end(table[MOMENT.column])
