"""What the search wrote: its closed form on what the data say without one."""

from __future__ import annotations

from bokeh.models import Span
from bokeh.plotting import figure

from freelearn.render.html.charts.canvas import chart, hover, legend_below, source
from freelearn.render.palette import COLORS
from freelearn.results.proposal_curve import ProposalCurve


def proposal_chart(curve: ProposalCurve) -> figure:
    """A line for the form; a dashed line and its 95 % band for a free function at the same place."""
    panel = chart(curve.title, curve.x, curve.y, 560, 360)
    data, x = source(curve.numbers), str(curve.numbers.columns[0])
    panel.varea(
        x=x, y1="low", y2="high", source=data, fill_color="#999999", fill_alpha=0.35,
        legend_label="free function, 95 % band",
    )  # fmt: skip
    panel.line(x=x, y="free", source=data, color="#555555", line_dash="dashed", legend_label="free function")
    line = panel.line(x=x, y="form", source=data, color=COLORS[0], width=2.5, legend_label="closed form")
    panel.add_layout(Span(location=0.0, dimension="width", line_width=0.7))
    hover(panel, [(curve.x, f"@{{{x}}}"), ("form", "@form"), ("free", "@free"), ("band", "@low … @high")], [line])
    legend_below(panel)
    return panel
