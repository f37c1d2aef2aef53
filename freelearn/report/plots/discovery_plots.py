"""The pictures of a discovery."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from freelearn.common.display import COLORS
from freelearn.discovery.thresholds import CLEAR
from freelearn.queries.curves.curve_panels import curve_numbers
from freelearn.queries.curves.curve_rows import measured_quantities, plane
from freelearn.queries.curves.shown_states import state_title
from freelearn.records.discovery import Discovery, trail_numbers
from freelearn.records.written_effects import ProposalCurve
from freelearn.report.plots.canvas import finish, heading, new_figure, save_all
from freelearn.report.plots.curve_plots import curves
from freelearn.report.plots.residual_plots import residual_map
from freelearn.report.tables.lab_notes import discovery_story
from freelearn.report.tables.ranking_tables import (
    COLLINEAR,
    NO_MORE,
    STANDS_OUT,
    Staircase,
    cosine_table,
    ranking_numbers,
)
from freelearn.report.tables.ranking_tables import staircase as stairs_of
from freelearn.report.tables.residual_tables import residual_table, scale_limits
from freelearn.report.tensorboard_log import SEARCHED, event_file


def proposal(curve: ProposalCurve, simulated: bool) -> Figure:
    """A line for the form; a dashed line and its 95 % band for a free function at the same place."""
    figure = new_figure(6.2, 4.2)
    figure.suptitle(heading(curve.title, simulated), fontsize=11)
    axes = figure.add_axes((0.15, 0.15, 0.81, 0.68))
    table = curve.numbers
    x = table.iloc[:, 0]
    axes.fill_between(x, table["low"], table["high"], color="0.82", lw=0, label="free function, 95 % band")
    # Above the form, which it lies on where nothing else is asked for.
    axes.plot(x, table["free"], color="black", lw=1.0, ls="--", label="free function", zorder=3)
    axes.plot(x, table["form"], color=COLORS[0], lw=2.6, alpha=0.8, label="closed form")
    axes.axhline(0.0, color="black", lw=0.6)
    finish(axes, curve.x, curve.y)
    axes.legend(frameon=False, fontsize=8.5, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return figure


# The pictures of a discovery, as files and in TensorBoard.

# A size of nothing still has a place on a logarithmic axis, the leftmost.
SMALLEST = 0.1
# Characters of a step's label on one line.
WIDE = 18


def draw_discovery(discovery: Discovery, folder: Path, simulated: bool) -> list[Path]:
    """Writes staircase, ranking, likeness, residuals_before, residuals_after and curves_* (.png, with a .csv each), and
    the same pictures, errors and parameters for TensorBoard; returns the pictures' paths."""
    findings = discovery.findings
    trail = trail_numbers(discovery.content)
    figures: dict[str, tuple[Figure, pd.DataFrame]] = {"staircase": (staircase(trail, simulated), trail)}
    last = len(findings.steps) - 1
    ranked = {
        when: ranking_numbers(discovery.content["candidates"], step)
        for when, step in (("before", 0), ("after", last))
        if when == "before" or last
    }
    if not len(ranked.get("after", ())):
        # A search over sets asks what each effect promises on the first model alone.
        ranked.pop("after", None)
    if len(ranked["before"]):
        numbers = pd.concat([part.assign(when=when) for when, part in ranked.items()], ignore_index=True)
        figures["ranking"] = ranking(ranked["before"], ranked.get("after"), simulated), numbers
    alike = cosine_table(*findings.cosines)
    if len(alike) > 1:
        figures["likeness"] = cosine_matrix(alike, simulated), alike
    both = list(discovery.trusted.values())
    over = plane(both[0])
    # One scale: on scales of their own noise looks like what was there before.
    limits = scale_limits(both, over, measured_quantities(both[0]))
    for when, step in (("before", findings.steps[0]), ("after", findings.final)):
        table = discovery.trusted[when]
        effects = " + ".join(step.effects) or "no effect"
        title = f"{when}: {step.fit.model.name}, {effects}"
        figures[f"residuals_{when}"] = residual_map(table, title, simulated, limits), residual_table(table, over)
    for number, (measured, named) in enumerate(discovery.curves, 1):
        title = f"{findings.final.fit.model.name}: {state_title(measured)}"
        figures[f"curves_{number}"] = curves(measured, named, title, simulated), curve_numbers(measured, named)
    for name, curve in discovery.unknowns.items():
        figures[f"proposal_{name}"] = proposal(curve, simulated), curve.numbers
    with event_file(folder) as writer:
        for number, step in enumerate(findings.steps):
            for what, error in (("fitted", step.E_train), ("held_out", step.E_heldout), ("noise_floor", step.floor)):
                writer.add_scalar(f"error_percent/{what}", 100 * error, number)
            for name, value in step.fit.values().items():
                writer.add_scalar(f"parameter/{name}", value, number)
        writer.add_text("story", discovery_story(discovery))
        writer.add_custom_scalars(SEARCHED)
        paths = save_all(figures, folder, writer)
    return paths


def staircase(trail: pd.DataFrame, simulated: bool) -> Figure:
    """Held-out error from step to step, down towards the noise floor. trail: of discovery.trail_numbers."""
    names = _step_names(stairs_of(trail))
    figure = new_figure(max(5.5, 2.2 + 1.5 * len(names)), 4.2)
    figure.suptitle(heading("Error on held-out kinematic states", simulated), fontsize=11)
    # Room for the steps' names, the longest of which has so many lines.
    foot = (0.3 + 0.16 * max(name.count("\n") + 1 for name in names)) / 4.2
    draw_staircase(figure.add_axes((0.13, foot, 0.84, 0.88 - foot)), trail)
    return figure


def draw_staircase(axes: Axes, trail: pd.DataFrame) -> None:
    """Draws a staircase on axes. trail: as of `staircase`."""
    stairs = stairs_of(trail)
    labels = _step_names(stairs)
    place = np.arange(len(labels))
    axes.plot(place, stairs.E, "o-", color=COLORS[0], ms=8, lw=1.6, label="held-out error")
    known = np.isfinite(stairs.E)
    for x, value, text, under in zip(
        place[known], stairs.E[known], np.array(stairs.labels)[known], stairs.under[known], strict=True
    ):
        # On the side away from the floor, whose line would go through it.
        offset, side = ((-4, -9), "top") if under else ((4, 8), "bottom")
        axes.annotate(
            text, (x, value), xytext=offset, textcoords="offset points", fontsize=9, va=side,
            ha="center" if under else "left",
        )  # fmt: skip
    axes.hlines(stairs.floor, place - 0.45, place + 0.45, color="black", linestyle="--", label="noise floor")
    axes.set_xticks(place, labels, fontsize=9)
    finish(axes, "", "E [%], logarithmic")
    axes.set_xlim(-0.6, len(labels) - 0.4)
    axes.set_yscale("log")
    axes.set_ylim(stairs.low, stairs.high)
    axes.yaxis.set_major_locator(FixedLocator(stairs.ticks))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    # Above: inside it might stand on the floor.
    axes.legend(frameon=False, fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def _step_names(stairs: Staircase) -> list[str]:
    """The names of a staircase's steps in lines; a plus stays with its effect."""
    parts = [step.replace(" + ", "\n+ ").replace("+ ", "+\u00a0").split("\n") for step in stairs.steps]
    return ["\n".join(fill(part, WIDE, break_long_words=False) for part in each) for each in parts]


def ranking(before: pd.DataFrame, after: pd.DataFrame | None, simulated: bool) -> Figure:
    """How much each effect promised before any was added, and after the last one: size in σ after refitting.

    before, after: of ranking_tables.ranking_numbers; None where nothing was added."""
    figure = new_figure(8.0, 1.95 + 0.27 * len(before))
    height = figure.get_size_inches()[1]
    figure.suptitle(heading("What each effect would explain", simulated), fontsize=11)
    axes = figure.add_axes((0.25, 1.2 / height, 0.7, 1 - 1.65 / height))
    draw_ranking(axes, before, after)
    figure.legend(*axes.get_legend_handles_labels(), frameon=False, fontsize=8.5, loc="lower center", ncols=2)
    return figure


def draw_ranking(axes: Axes, before: pd.DataFrame, after: pd.DataFrame | None) -> None:
    """Draws a ranking on axes, without its legend. before, after: as of `ranking`."""
    before = before.sort_values("size")
    names = before["effect"].tolist()
    place = np.arange(len(names))
    certain = (before["p_value"] <= CLEAR).to_numpy()
    # Points and not bars: on a logarithmic axis the length of a bar is as long as where the axis begins.
    size = before["size"].clip(lower=SMALLEST).to_numpy()
    for chosen, inside, label in ((certain, COLORS[0], STANDS_OUT), (~certain, "white", NO_MORE)):
        style: dict[str, Any] = {"color": COLORS[0], "mfc": inside, "ms": 7, "mew": 1.4}
        axes.plot(size[chosen], place[chosen], "o", label=f"before: {label}", **style)
    if after is not None:
        later = after.set_index("effect")["size"].reindex(names).clip(lower=SMALLEST)
        axes.plot(later, place, "D", color=COLORS[1], ms=4.5, label="after the last effect was added")
    axes.set_yticks(place, names, fontsize=9)
    axes.set_ylim(-0.7, len(names) - 0.3)
    axes.set_xscale("log")
    axes.set_xlim(left=0.8 * SMALLEST)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    unit = "effect size after refitting [noise standard deviations]"
    finish(axes, f"{unit},\nlogarithmic; {SMALLEST:g} and less at the left edge", "")


def cosine_matrix(table: pd.DataFrame, simulated: bool) -> Figure:
    """How alike the effects' traces are in these data. table: of ranking_tables.likeness_table."""
    names = table["effect"].tolist()
    cosine = table[names].to_numpy(dtype=np.float64)
    side = 2.6 + 0.3 * len(names)
    figure = new_figure(side + 0.8, side)
    axes = figure.add_axes((2.0 / (side + 0.8), 1.75 / side, 0.3 * len(names) / (side + 0.8), 0.3 * len(names) / side))
    image = axes.imshow(cosine, cmap="viridis_r", vmin=0, vmax=1)
    for i, j in zip(*np.nonzero(cosine > COLLINEAR), strict=True):
        if i != j:
            axes.text(j, i, "=", ha="center", va="center", color="white", fontsize=9, weight="bold")
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.tick_params(length=0)
    figure.suptitle(heading("Effects that look alike on these data", simulated), fontsize=10.5)
    bar = figure.colorbar(image, ax=axes, fraction=0.046, pad=0.03)
    bar.set_label(f"cosine after refitting (= above {COLLINEAR:g})", fontsize=8)
    return figure
