"""The maps of a fitted model as pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from freelearn.data.beds import Pair
from freelearn.queries.maps.maps import Maps
from freelearn.queries.maps.stiffness_map import Panel, Rate, StiffnessMap
from freelearn.report.plots.canvas import LINE, Sheet, head_and_foot, heading, lines_of, new_figure
from freelearn.report.plots.reach_plots import reachable
from freelearn.report.tables.residual_tables import MOST_SAMPLES, scale_end

# How stiff an actuator is over the plane of its poses.

# As the maps of errors and of residuals: lightness changes all along, or is highest in the middle.
RISING, SIGNED = "viridis", "PuOr"
# With more planes side by side each has a scale of its own, and its lines no numbers.
FEW = 3
# Percent of the numbers at either end that do not stretch a scale: near a loss of equilibrium stiffness has no bounds.
TAIL = 1.0
NOT_FITTED = " (not fitted)"


def stiffness(found: StiffnessMap, title: str, simulated: bool) -> Figure:
    """A column for each sample or pressure, a row for each entry of the stiffness. title: the model.

    Hatched where the stiffness is not positive definite, blank without an equilibrium. Up to three planes share a scale
    in each row, and its lines are numbered; of more each has its own, whose ends stand above it. The rows stand side by
    side where there is one plane.
    """
    every = list(found.panels())
    panels, rates = every[:MOST_SAMPLES], found.rates
    notes = [*found.notes]
    if len(every) > len(panels):
        notes.append(f"Shown: first {len(panels)} of {len(every)} planes.")
    alone, few = len(panels) == 1, len(panels) <= FEW
    legend = _keys([panel.rows for panel in panels])
    sheet, lines = _sheet(len(panels), len(rates), notes, bool(legend))
    figure = new_figure(sheet.width, sheet.height)
    above = head_and_foot(figure, [heading(title, simulated), _what(panels)], lines)
    for row, rate in enumerate(rates):
        shared = _scale([panel.rows for panel in panels], rate)
        for column, panel in enumerate(panels):
            place = (row, 0) if alone else (column, row)
            axes = figure.add_axes(sheet.field(*place))
            norm = shared if few else _scale([panel.rows], rate)
            _draw(axes, panel.rows, found.over, rate, norm, numbered=few)
            _frame(axes, found.over, left=place[0] == 0, bottom=place[1] == sheet.down - 1)
            heads = [] if alone or row else [_name(found, panel, panels)]
            axes.set_title("\n".join(heads if few else [*heads, _ends(norm, rate)]), fontsize=8.5)
        bar = figure.add_axes(sheet.bar(*((row, 0) if alone else (len(panels) - 1, row))))
        bar.tick_params(labelsize=8)
        norm = shared if few else Normalize(-1 if rate.signed else 0, 1)
        figure.colorbar(ScalarMappable(norm, _colors(rate)), cax=bar)
        label = rate.label if few else f"{rate.name} {rate.symbol}\n[share of the range above]"
        bar.set_ylabel(label, fontsize=8.5)
    if legend:
        middle = (0.5, above / sheet.height)
        figure.legend(handles=legend, loc="lower center", ncols=2, frameon=False, fontsize=8.5, bbox_to_anchor=middle)
    return figure


def _sheet(panels: int, rates: int, notes: Sequence[str], legend: bool) -> tuple[Sheet, list[str]]:
    """Where the fields stand, and the notes in lines that are as wide."""
    if panels == 1:
        sheet = Sheet(rates, 1, wide=2.9, high=3.0, apart=1.5, below=0.0, right=1.1, top=0.65, foot=0.6)
    elif panels <= FEW:
        sheet = Sheet(panels, rates, wide=2.7, high=2.4, apart=0.2, below=0.2, right=1.1, top=0.85, foot=0.6)
    else:
        sheet = Sheet(panels, rates, wide=1.5, high=1.7, apart=0.12, below=0.38, right=1.1, top=1.0, foot=0.6)
    lines = lines_of(notes, sheet.width)
    return replace(sheet, foot=sheet.foot + LINE * len(lines) + (0.3 if legend else 0.0)), lines


def _draw(axes: Axes, rows: pd.DataFrame, over: Pair, rate: Rate, norm: Normalize, numbered: bool) -> None:
    """One field, its lines of equal stiffness, and hatches where it is not stable. rows: of a plane."""
    across, up = (np.unique(rows[quantity.column]) for quantity in over)
    shape = len(across), len(up)
    columns = (rate.column, "least_nm_per_rad")
    value, least = (np.ma.masked_invalid(rows[name].to_numpy(np.float64).reshape(shape).T) for name in columns)
    # What is blank has no smooth edge.
    smooth = not np.ma.is_masked(value)
    axes.pcolormesh(across, up, value, norm=norm, cmap=_colors(rate), shading="gouraud" if smooth else "nearest")
    ticks = MaxNLocator(7).tick_values(*_limits(norm))
    levels = [tick for tick in ticks if value.min() < tick < value.max()]
    if levels:
        lines = axes.contour(across, up, value, levels, colors="black", linewidths=0.6)
        if numbered:
            for text in axes.clabel(lines, fontsize=7.5, fmt=lambda v: f"{v:g}".replace("-", "−")):
                text.set_bbox({"facecolor": "white", "alpha": 0.6, "edgecolor": "none", "pad": 0.6})
    if least.min() < 0:
        loose = axes.contourf(across, up, least, [least.min() - 1, 0], colors="none", hatches=["////"])
        loose.set(edgecolor="black", linewidth=0.0)
    axes.set(xlim=(across[0], across[-1]), ylim=(up[0], up[-1]))


def _frame(axes: Axes, over: Pair, left: bool, bottom: bool) -> None:
    axes.tick_params(labelsize=8, labelleft=left, labelbottom=bottom)
    axes.xaxis.set_major_locator(MaxNLocator(4, prune="both"))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set_xlabel(over[0].label if bottom else "")
    axes.set_ylabel(over[1].label if left else "")


def _keys(planes: Sequence[pd.DataFrame]) -> list[Patch]:
    """Names what is hatched and what is blank, where anything is."""
    every = pd.concat(planes)["stable"]
    keys = []
    if (every == 0).any():
        keys.append(Patch(facecolor="white", edgecolor="black", hatch="////", label="not stable under a dead load"))
    if every.isna().any():
        keys.append(Patch(facecolor="white", edgecolor="0.5", label="no equilibrium"))
    return keys


def _scale(planes: Sequence[pd.DataFrame], rate: Rate) -> Normalize:
    """From the least to the largest of some planes; of what has a sign, even about zero."""
    values = np.concatenate([plane[rate.column].to_numpy(np.float64) for plane in planes])
    values = values[np.isfinite(values)]
    if not len(values):
        return Normalize(0, 1)
    low, high = (float(end) for end in np.percentile(values, (TAIL, 100 - TAIL)))
    if rate.signed:
        end = scale_end([low, high])
        return Normalize(-end, end)
    return Normalize(low, high) if high > low else Normalize(low - 0.5, low + 0.5)


def _colors(rate: Rate) -> str:
    return SIGNED if rate.signed else RISING


def _ends(norm: Normalize, rate: Rate) -> str:
    """The ends of a field's own scale."""
    low, high = _limits(norm)
    return f"± {high:.2g} {rate.unit}" if rate.signed else f"{low:.2g} … {high:.2g} {rate.unit}".replace("-", "−")


def _limits(norm: Normalize) -> tuple[float, float]:
    assert norm.vmin is not None
    assert norm.vmax is not None
    return norm.vmin, norm.vmax


def _what(panels: Sequence[Panel]) -> str:
    """The heading's second line: with the pressure, where the fields do not say it."""
    names = {panel.name for panel in panels} - {""}
    return "tangent stiffness" + (f" at {names.pop()}" if len(names) == 1 else "")


def _name(found: StiffnessMap, panel: Panel, panels: Sequence[Panel]) -> str:
    """What tells a plane from the others."""
    parts = []
    if len({other.sample for other in panels}) > 1:
        parts.append(f"sample {panel.sample}" + ("" if panel.sample in found.fitted else NOT_FITTED))
    if len({other.name for other in panels}) > 1:
        parts.append(panel.name)
    return ", ".join(parts)


@dataclass(frozen=True)
class Picture:
    """name: of its files; table: what is drawn."""

    name: str
    figure: Figure
    table: pd.DataFrame


def pictures(maps: Maps, title: str, simulated: bool) -> list[Picture]:
    """One of each map; of several samples, whose planes stand side by side, one of the stiffness at each pressure."""
    drawn = []
    if maps.loads:
        drawn.append(Picture("load_polygon", reachable(maps.loads, title, simulated), maps.loads.points))
    drawn.append(Picture("reachable_poses", reachable(maps.poses, title, simulated), maps.poses.points))
    if maps.stiffness:
        found, names = maps.stiffness, maps.stiffness.ats
        apart = len(names) > 1 and found.table["sample"].nunique() > 1
        parts = [(f"stiffness_{name}", found.at(name)) for name in names] if apart else [("stiffness", found)]
        drawn += [Picture(name, stiffness(part, title, simulated), part.table) for name, part in parts]
    return drawn
