"""A recording over time, loops over the pressure colored by its rate, and spectra of what a model leaves."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from freelearn.common.display import COLORS
from freelearn.common.formats import MINUS
from freelearn.data.logs import RUN
from freelearn.queries.curves.curve_rows import measured_quantities, pressures, sweep
from freelearn.queries.curves.log_spectra import HERTZ, LEFT, STATED, Spectrum
from freelearn.queries.curves.log_traces import SECONDS, Loops, Trace, loops_of, trace_of, worst_recording
from freelearn.report.plots.canvas import finish, heading, new_figure

MODEL = "model"
INCHES = 3.6


def recording_figure(own: pd.DataFrame, spectra: Sequence[Spectrum], title: str, simulated: bool) -> Figure:
    """A row for each: what was imposed and measured along the recording that is predicted worst, beside the model;
    loops of its sample; spectra. own: rows of a log in the columns of predictions.csv."""
    rows, sample = worst_recording(own)
    known = measured_quantities(sample)
    across = 1 + len(known)
    figure = new_figure(INCHES * across + 0.8, 9.6)
    name = f"{title}: sample {rows['sample'].iloc[0]}, run {rows[RUN].iloc[0]}"
    figure.suptitle(heading(name.replace("-", MINUS), simulated), fontsize=11)
    figure.set_layout_engine("constrained")
    axes = figure.subplots(3, across)
    draw_recording(list(axes[0]), rows)
    draw_loops(list(axes[1, : len(known)]), sample)
    draw_spectra(list(axes[2, : len(spectra)]), spectra)
    for unused in (*axes[1, len(known) :], *axes[2, len(spectra) :]):
        unused.axis("off")
    return figure


def draw_recording(axes: Sequence[Axes], rows: pd.DataFrame) -> Trace:
    """The pressures, then each measured quantity with what the model says, over time; as many axes. rows: of one
    recording."""
    known = measured_quantities(rows)
    trace = trace_of(rows, sweep(rows).over, {MODEL: rows})
    imposed = pressures(rows)
    for quantity, color in zip(imposed, cycle(("black", *COLORS)), strict=False):
        signal = trace.imposed[quantity.column]
        axes[0].plot(signal.time, signal.value, color=color, lw=1.1, label=quantity.symbol)
    if len(imposed) > 1:
        axes[0].legend(frameon=False, fontsize=8)
    finish(axes[0], SECONDS, imposed[0].label)
    for one, quantity in zip(axes[1:], known, strict=True):
        measured, model = trace.measured[quantity.column], trace.models[MODEL][quantity.column]
        one.plot(measured.time, measured.value, color="black", lw=1.1, label="measured")
        one.plot(model.time, model.value, color=COLORS[1], lw=1.4, ls="--", label=MODEL)
        one.legend(frameon=False, fontsize=8)
        finish(one, SECONDS, quantity.label)
    return trace


def draw_loops(axes: Sequence[Axes], sample: pd.DataFrame) -> list[Loops]:
    """Each measured quantity over the pressure, colored by how fast that changes; as many axes. sample: its rows."""
    over, shown = sweep(sample).over, []
    for one, quantity in zip(axes, measured_quantities(sample), strict=True):
        loops = loops_of(sample, over, quantity)
        points = np.stack([loops.pressure, loops.value], axis=1)
        lines = LineCollection(
            list(np.stack([points[loops.joined], points[loops.joined + 1]], axis=1)), cmap="cividis",
            norm=Normalize(0, loops.fastest), linewidths=1.3,
        )  # fmt: skip
        lines.set_array(loops.speed)
        one.add_collection(lines)
        one.autoscale()
        bar = one.get_figure().colorbar(lines, ax=one)  # type: ignore[union-attr]
        bar.set_label(f"rate of the pressure [{over.unit}/s]")
        finish(one, over.label, quantity.label)
        shown.append(loops)
    return shown


def draw_spectra(axes: Sequence[Axes], spectra: Sequence[Spectrum]) -> None:
    """What is left of each quantity by its frequency, and the noise as it was stated; as many axes."""
    for one, spectrum in zip(axes, spectra, strict=True):
        label = f"{spectrum.quantity.name}: {LEFT}"
        # Of a model that leaves nothing at all a logarithm shows nothing.
        there = spectrum.density > 0
        one.plot(spectrum.frequency[there], spectrum.density[there], color=COLORS[1], lw=1.4, label=label)
        if spectrum.noise is not None:
            one.axhline(spectrum.noise, color="black", lw=1.2, ls="--", label=STATED)
        if there.any():
            one.set(xscale="log", yscale="log")
        one.legend(frameon=False, fontsize=8)
        finish(one, HERTZ, f"power density [{spectrum.unit}]")
