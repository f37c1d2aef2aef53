"""What every interactive chart has in common: a quiet frame, units on the axes, one set of tools."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from bokeh.events import LegendItemClick
from bokeh.models import ColumnDataSource, CustomJS, GlyphRenderer, HoverTool, Legend, LegendItem
from bokeh.plotting import figure

# After a click the likeness is hidden, or shown.
_HIDDEN_TOO = """
    const place = items.indexOf(cb_obj.item)
    for (const glyph of drawn[place]) glyph.visible = !glyph.visible
"""
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


def still_legend(drawn: figure, entries: Mapping[str, Sequence[GlyphRenderer]]) -> None:
    """A legend below for data that are exchanged often. entries: what each name stands for, and hides.

    Bokeh builds a legend anew whenever the data change of what it refers to, which takes longer than to draw them. So
    this one refers to likenesses of them, which are nowhere and stay as they are."""
    names = {name for glyphs in entries.values() for glyph in glyphs for name in glyph.data_source.column_names}
    nowhere = ColumnDataSource({name: [np.nan] for name in names})
    items = []
    for label, glyphs in entries.items():
        alike = [GlyphRenderer(data_source=nowhere, glyph=glyph.glyph) for glyph in glyphs]
        drawn.renderers.extend(alike)
        items.append(LegendItem(label=label, renderers=alike))
    legend = Legend(items=items)
    # Not a link of the likeness to what it is one of: that again would be what it refers to.
    hidden = CustomJS(args={"items": items, "drawn": list(entries.values())}, code=_HIDDEN_TOO)
    legend.js_on_event(LegendItemClick, hidden)
    drawn.add_layout(legend)
    legend_below(drawn)
