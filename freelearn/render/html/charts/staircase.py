"""The error falling from step to step towards the noise floor."""

from __future__ import annotations

from textwrap import fill

import numpy as np
import pandas as pd
from bokeh.models import BasicTickFormatter, ColumnDataSource, FixedTicker
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, legend_below
from freelearn.render.palette import COLORS
from freelearn.results.staircase import staircase

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
