"""What every interactive chart has in common: a quiet frame, units on the axes, one set of tools."""

from __future__ import annotations

import pandas as pd
from bokeh.models import ColumnDataSource, HoverTool
from bokeh.plotting import figure

TOOLS = "pan,box_zoom,wheel_zoom,reset,save"


def chart(title: str, x: str, y: str, width: int = 400, height: int = 330, **options: object) -> figure:
    """An empty chart; labels carry their units."""
    drawn = figure(title=title, x_axis_label=x, y_axis_label=y, width=width, height=height, tools=TOOLS, **options)
    drawn.toolbar.logo = None
    drawn.toolbar.autohide = True
    drawn.title.text_font_size = "10.5pt"
    drawn.grid.grid_line_alpha = 0.4
    for axis in drawn.axis:
        axis.axis_label_text_font_style = "normal"
        axis.minor_tick_line_color = None
    return drawn


def hover(drawn: figure, tips: list[tuple[str, str]], renderers: list[object]) -> None:
    """Values under the mouse."""
    drawn.add_tools(HoverTool(tooltips=tips, renderers=renderers))


def source(table: pd.DataFrame) -> ColumnDataSource:
    """The table's columns, without its index."""
    return ColumnDataSource({name: table[name].to_numpy() for name in table.columns})


def legend_below(drawn: figure) -> None:
    """Moves the legend out of the data's way; clicking an entry hides what it names."""
    legend = drawn.legend[0]
    legend.click_policy = "hide"
    legend.orientation = "horizontal"
    legend.label_text_font_size = "8.5pt"
    legend.padding = legend.margin = 2
    legend.spacing = 8
    legend.border_line_color = None
    drawn.add_layout(legend, "below")
