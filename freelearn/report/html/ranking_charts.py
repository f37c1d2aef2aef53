"""Effects beside each other: what each explains, how alike they are, and how the error falls from step to step."""

from __future__ import annotations

from textwrap import fill

import numpy as np
import pandas as pd
from bokeh.models import BasicTickFormatter, ColorBar, ColumnDataSource, FixedTicker, LinearColorMapper
from bokeh.palettes import Viridis256
from bokeh.plotting import figure

from freelearn.common.display import COLORS
from freelearn.discovery.thresholds import CLEAR
from freelearn.report.html.chart_canvas import chart, hover, legend_below, source
from freelearn.report.tables.ranking_tables import COLLINEAR, NO_MORE, STANDS_OUT, staircase

# How alike the effects' traces are in these data.

# Pixels of a cell, and of the names beside the cells.
CELL, NAMES = 17, 170


def cosine_chart(table: pd.DataFrame) -> figure:
    """Every effect against every other, dark where they look alike. table: of ranking_tables.likeness_table."""
    names = table["effect"].tolist()
    cosine = table[names].to_numpy(dtype=np.float64)
    side = CELL * len(names) + NAMES
    panel = chart("", "", "", side + 70, side, x_range=names, y_range=names[::-1])
    one, other = np.meshgrid(names, names, indexing="ij")
    mark = np.where((cosine > COLLINEAR) & (one != other), "=", "")
    columns = {"one": one.ravel(), "other": other.ravel(), "cosine": cosine.ravel(), "mark": mark.ravel()}
    cells = source(pd.DataFrame(columns))
    mapper = LinearColorMapper(Viridis256[::-1], low=0, high=1)
    squares = panel.rect(
        "other", "one", 1, 1, source=cells, line_color=None, fill_color={"field": "cosine", "transform": mapper}
    )
    panel.text(
        "other", "one", text="mark", source=cells, text_color="white", text_align="center", text_baseline="middle",
        text_font_size="8pt", text_font_style="bold",
    )  # fmt: skip
    hover(panel, [("effects", "@one, @other"), ("cosine", "@cosine{0.00}")], [squares])
    panel.xaxis.major_label_orientation = 1.0
    panel.grid.visible = False
    panel.add_layout(ColorBar(color_mapper=mapper, title="cosine", width=10, padding=4), "right")
    return panel


# How much each effect would explain.

# A size of nothing still has a place on a logarithmic axis, the leftmost.
SMALLEST = 0.1


def ranking_chart(table: pd.DataFrame) -> figure:
    """Points by size, filled where chance is ruled out. table: of ranking_tables.ranking_numbers."""
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


# The error falling from step to step towards the noise floor.

# By which an axis goes on below a label that stands under its mark.
ROOM = 1.6
# Letters to a line of a step's name.
WIDEST = 22


class StaircaseChart:
    """Error by step on a logarithmic axis; its data can be exchanged. what: which error, held-out or test error."""

    def __init__(self, width: int = 480, height: int = 340, what: str = "held-out error") -> None:
        self.source = ColumnDataSource({name: [] for name in ("step", "E", "floor", "label", "offset")})
        self.panel: figure = chart(
            f"{what}, step by step",
            "",
            "E [%], logarithmic",
            width,
            height,
            x_range=[],
            y_axis_type="log",
            y_range=(0.1, 100.0),
        )
        self.panel.yaxis.formatter = BasicTickFormatter(use_scientific=False)
        where = {"x": "step", "source": self.source}
        self.panel.line(y="floor", color="black", line_dash="dashed", width=1.5, legend_label="noise floor", **where)
        self.panel.line(y="E", color=COLORS[0], width=2, legend_label=what, **where)
        self.panel.scatter(y="floor", marker="dash", size=16, color="black", **where)
        marks = self.panel.scatter(y="E", size=9, color=COLORS[0], **where)
        # On the side away from the floor, whose line would go through it.
        self.panel.text(y="E", text="label", y_offset="offset", text_align="center", text_font_size="9pt", **where)
        hover(self.panel, [("step", "@step"), ("E", "@E{0.000} %"), ("noise floor", "@floor{0.000} %")], [marks])
        self.panel.xaxis.major_label_orientation = 0.35
        legend_below(self.panel)

    def show(self, trail: pd.DataFrame) -> None:
        """trail: step, E_heldout, noise_floor (fractions; blank where it is not known), in order."""
        stairs = staircase(trail)
        # Long names take several lines: at an angle they would leave the chart no room.
        steps = [fill(f"{number}. {name}", WIDEST, break_long_words=False) for number, name in enumerate(stairs.steps)]
        self.panel.x_range.factors = steps
        self.panel.y_range.start, self.panel.y_range.end = (
            stairs.low / (ROOM if np.any(stairs.under) else 1),
            stairs.high,
        )
        self.panel.yaxis.ticker = FixedTicker(ticks=stairs.ticks)
        offset = np.where(stairs.under, 22, -6)
        columns = {"step": steps, "E": stairs.E, "floor": stairs.floor, "label": stairs.labels, "offset": offset}
        self.source.data = columns
