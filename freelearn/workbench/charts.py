"""Parts of the page beside each other, as many as its width has room for."""

from __future__ import annotations

from typing import Any

import panel as pn
from bokeh.plotting import figure

NARROWEST = 300  # px, of a chart


def wide(drawn: figure) -> pn.pane.Bokeh:
    """The chart, as wide as its place."""
    drawn.sizing_mode = "stretch_width"
    return pn.pane.Bokeh(drawn, sizing_mode="stretch_width", height=drawn.height)


def beside(*parts: Any, columns: str = f"repeat(auto-fit, minmax({NARROWEST}px, 1fr))") -> pn.FlexBox:
    """Parts beside each other, in further rows what does not fit. columns: their widths, as CSS grids have them."""
    # Not Bokeh's own layouts: these give all charts in them the same margins, as wide as the widest needs them.
    grid = f"div[id^=flexbox] {{ display: grid !important; grid-template-columns: {columns}; align-items: start; }}"
    return pn.FlexBox(*parts, sizing_mode="stretch_width", stylesheets=[grid])
