"""Predicted against measured, measured loads, and the states that are reached."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from freelearn.common.display import COLORS
from freelearn.data.beds import ELONGATION, TWIST, Quantity
from freelearn.queries.curves.curve_panels import LOOSE
from freelearn.queries.curves.curve_rows import measured_quantities, plane
from freelearn.report.plots.canvas import finish, heading, new_figure
from freelearn.report.plots.residual_plots import frame, marker_area
from freelearn.report.tables.picture_numbers import (
    SPLITS,
    admissible_table,
    load_vector_table,
    loose_rows,
    parity_ends,
    parity_numbers,
    sample_shares,
    split_labels,
)
from freelearn.report.tables.residual_tables import Strip, shown_samples

MARKERS = ("o", "^", "s")


def parity(predictions: pd.DataFrame, title: str, simulated: bool) -> Figure:
    """A panel each for force and moment, or what else was measured: usable rows by split, those of a tube that hangs
    loose apart, and the line on which a perfect model would lie.

    predictions: columns of predictions.csv.
    """
    quantities = measured_quantities(predictions)
    width = 4.75 * len(quantities)
    figure = new_figure(width, 4.6)
    figure.suptitle(heading(title, simulated))
    figure.subplots_adjust(left=0.855 / width, right=1 - 0.19 / width, bottom=0.13, top=0.88, wspace=0.28)
    panels = [figure.add_subplot(1, len(quantities), panel + 1) for panel in range(len(quantities))]
    draw_parity(panels, predictions, quantities)
    return figure


def draw_parity(panels: Sequence[Axes], predictions: pd.DataFrame, quantities: Sequence[Quantity]) -> None:
    """Draws one quantity on each of the axes. predictions, quantities: as of `parity`."""
    shown, labels = parity_numbers(predictions), split_labels(predictions)
    loose = shown[loose_rows(shown)]
    shown = shown[~loose_rows(shown)]
    for axes, load in zip(panels, quantities, strict=True):
        for split, marker, color in zip(SPLITS, MARKERS, COLORS, strict=False):
            if split in labels:
                part = shown[shown["split"] == split]
                axes.plot(
                    part[load.column], part[load.predicted], marker, color=color, ms=3.5, mfc="none", mew=0.7,
                    label=labels[split],
                )  # fmt: skip
        if len(loose):
            axes.plot(loose[load.column], loose[load.predicted], "d", color="0.4", ms=4.5, mfc="none", label=LOOSE)
        if len(shown):
            (ends,) = parity_ends(shown, [load])
            axes.plot(ends, ends, "-", color="black", linewidth=1, label="perfect")
        finish(axes, f"measured {load.label}", f"predicted {load.label}")
        # Of a model that answers no row there is nothing to name.
        if axes.get_legend_handles_labels()[0]:
            axes.legend(frameon=False, fontsize=8)


# Which states an actuator reaches without buckling.

SCALE = "viridis"


def admissible(table: pd.DataFrame, simulated: bool) -> Figure:
    """One field per sample, up to eight in a row: share of a state's pressure steps without buckling."""
    over = plane(table)
    states = admissible_table(table, over)
    samples, _ = shown_samples(table)
    strip = Strip(states[states["sample"].isin(samples)], samples, over)
    figure = new_figure(min(14.0, 3.5 + 1.6 * len(samples)), 4.0)
    figure.suptitle(heading("Admissible data: share of pressure steps without buckling", simulated), fontsize=11)
    width = figure.get_figwidth()
    axes = figure.add_axes((0.75 / width, 0.14, 1 - 2.0 / width, 0.66))
    axes.scatter(
        strip.across(), strip.up(), c=strip.states["share"], cmap=SCALE, vmin=0, vmax=1,
        s=marker_area(strip, axes), marker="s",
    )  # fmt: skip
    frame(strip, axes, bottom=True)
    whole = sample_shares(table)
    for number in samples:
        where = axes.get_xaxis_transform()
        text = f"sample {number}\n{100 * whole[number]:.0f} %"
        axes.text(strip.middle(number), 1.02, text, transform=where, ha="center", va="bottom", fontsize=9)
    bar = figure.add_axes((1 - 1.13 / width, 0.14, 0.15 / width, 0.66))
    figure.colorbar(ScalarMappable(Normalize(0, 1), SCALE), cax=bar, label="share without buckling [1]")
    return figure


# Measured loads as vectors over the kinematic plane, before any model.


def load_vectors(table: pd.DataFrame, simulated: bool) -> Figure:
    """One panel per sample: an arrow per kinematic state, force to the right, moment up, at both ends of the pressure.

    Arrows of one panel share a scale, each load over its largest value there, given above the panel.
    """
    vectors = load_vector_table(table)
    samples, _ = shown_samples(table)
    across = min(4, len(samples))
    down = -(-len(samples) // across)
    figure = new_figure(1.2 + 3.3 * across, 0.9 + 3.1 * down)
    figure.suptitle(heading("Measured loads: force to the right, moment up", simulated), fontsize=11)
    for number, sample in enumerate(samples):
        part = vectors[vectors["sample"] == sample]
        axes = figure.add_subplot(down, across, number + 1)
        largest = part[["force_n", "moment_nmm"]].abs().max().replace(0, 1)
        for color, (end, label) in zip(COLORS, (("low", "lowest"), ("high", "highest")), strict=False):
            rows = part[part["end"] == end]
            axes.quiver(
                rows["elongation_mm"], rows["twist_deg"], rows["force_n"] / largest["force_n"],
                rows["moment_nmm"] / largest["moment_nmm"], color=color, scale=14, width=0.005,
                label=f"at the {label} pressure",
            )  # fmt: skip
        title = f"sample {sample}: up to {largest['force_n']:.3g} N, {largest['moment_nmm']:.3g} N·mm"
        axes.set_title(title, fontsize=8.5)
        axes.set_xlabel(ELONGATION.label)
        axes.set_ylabel(TWIST.label)
        axes.margins(0.12)
    figure.tight_layout(rect=(0, 0.05, 1, 0.98))
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=2, frameon=False, fontsize=9)
    return figure
