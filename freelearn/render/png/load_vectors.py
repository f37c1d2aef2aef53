"""Measured loads as vectors over the kinematic plane, before any model."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from freelearn.measurements.beds import ELONGATION, TWIST
from freelearn.render.palette import COLORS
from freelearn.render.png.canvas import heading, new_figure
from freelearn.results.load_vectors import load_vector_table
from freelearn.results.residuals import shown_samples


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
