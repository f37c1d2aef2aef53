"""Parts of the page beside each other, as many as its width has room for."""

from __future__ import annotations

from typing import Any

import panel as pn
from bokeh.models import CustomJSTickFormatter
from bokeh.plotting import figure

NARROWEST = 300  # px, of a chart
# Of a legend, px: a state with a suspected reading names one thing more.
TWO_ROWS = 54
# Of five signs in letters of one width, or more; a blank before each has them stand at one height.
_EQUALLY_WIDE = """
    const text = String(Number(tick.toPrecision(6))).replaceAll("-", "\u2212")
    return " " + text.padStart(5)
"""


def wide(drawn: figure) -> pn.pane.Bokeh:
    """The chart, as wide as its place."""
    drawn.sizing_mode = "stretch_width"
    return pn.pane.Bokeh(drawn, sizing_mode="stretch_width", height=drawn.height)


def steady(drawn: figure) -> None:
    """Has labels of the upright axis and the legend take the same room, whatever they say: else the browser lays out
    the whole page anew where a curve needs one digit more, which takes longer than to draw it."""
    drawn.yaxis.formatter = CustomJSTickFormatter(code=_EQUALLY_WIDE)
    drawn.yaxis.major_label_text_font = "monospace"
    drawn.yaxis.major_label_standoff = 2
    drawn.legend.styles = {"min-height": f"{TWO_ROWS}px"}


def beside(*parts: Any, columns: str = f"repeat(auto-fit, minmax({NARROWEST}px, 1fr))") -> pn.FlexBox:
    """Parts beside each other, in further rows what does not fit. columns: their widths, as CSS grids have them."""
    # Not Bokeh's own layouts: these give all charts in them the same margins, as wide as the widest needs them.
    grid = f"div[id^=flexbox] {{ display: grid !important; grid-template-columns: {columns}; align-items: start; }}"
    return pn.FlexBox(*parts, sizing_mode="stretch_width", stylesheets=[grid])
