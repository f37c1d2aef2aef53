"""What the search wrote: its closed form on what the data say without one."""

from __future__ import annotations

from matplotlib.figure import Figure

from freelearn.render.palette import COLORS
from freelearn.render.png.canvas import finish, heading, new_figure
from freelearn.results.proposal_curve import ProposalCurve


def proposal(curve: ProposalCurve, simulated: bool) -> Figure:
    """A line for the form; a dashed line and its 95 % band for a free function at the same place."""
    figure = new_figure(6.2, 4.2)
    figure.suptitle(heading(curve.title, simulated), fontsize=11)
    axes = figure.add_axes((0.15, 0.15, 0.81, 0.68))
    table = curve.numbers
    x = table.iloc[:, 0]
    axes.fill_between(x, table["low"], table["high"], color="0.82", lw=0, label="free function, 95 % band")
    axes.plot(x, table["free"], color="0.35", lw=1.2, ls="--", label="free function")
    axes.plot(x, table["form"], color=COLORS[0], lw=2.0, label="closed form")
    axes.axhline(0.0, color="black", lw=0.6)
    finish(axes, curve.x, curve.y)
    axes.legend(frameon=False, fontsize=8.5, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return figure
