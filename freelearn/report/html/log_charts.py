"""A recording over time, loops of what was measured over the pressure, and spectra of what a model leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from bokeh.models import ColorBar, ColumnDataSource, LinearColorMapper, Range1d
from bokeh.palettes import Cividis256
from bokeh.plotting import figure

from freelearn.common.display import COLORS
from freelearn.data.beds import Quantity
from freelearn.queries.curves.log_spectra import HERTZ, LEFT, STATED, Spectrum
from freelearn.queries.curves.log_traces import SECONDS, Loops, Signal, Trace
from freelearn.report.html.chart_canvas import chart, legend_below
from freelearn.report.html.curve_charts import DASHES, MEASURED

# A signal without a sample.
NOTHING: dict[str, list[float]] = {"x": [], "y": []}
# Widths of the loops: of the recording that is looked at, and of the others [px].
THICK, THIN = 3.0, 1.0


class LogCharts:
    """Charts whose data can be exchanged: `times`, the pressures and each measured quantity over one time axis;
    `loops`, each quantity over the pressure. models: names of the models drawn, in order, and their colors."""

    def __init__(
        self,
        models: Mapping[str, str],
        imposed: Sequence[Quantity],
        measured: Sequence[Quantity],
        over: Quantity,
        width: int = 400,
        height: int = 240,
        loop_height: int = 330,
    ) -> None:
        self.models, self.imposed, self.measured, self.over = models, imposed, measured, over
        self.time = Range1d(0, 1)
        self.across = ColumnDataSource(NOTHING)
        self.pressures = {q.column: ColumnDataSource(NOTHING) for q in imposed}
        self.readings = {q.column: ColumnDataSource(NOTHING) for q in measured}
        self.predicted = {name: {q.column: ColumnDataSource(NOTHING) for q in measured} for name in models}
        self.times = [self._pressure_chart(width, height), *(self._reading_chart(q, width, height) for q in measured)]
        none: dict[str, list[float]] = {name: [] for name in ("x0", "y0", "x1", "y1", "rate", "wide")}
        self.segments = {q.column: ColumnDataSource(none) for q in measured}
        # What a model says of the recording that is looked at.
        self.modeled = {name: {q.column: ColumnDataSource(NOTHING) for q in measured} for name in models}
        self.mapper = LinearColorMapper(Cividis256, low=0, high=1)
        self.loops = [self._loop_chart(q, width, loop_height) for q in measured]

    def _pressure_chart(self, width: int, height: int) -> figure:
        several = len(self.imposed) > 1
        label = self.imposed[0].label if not several else f"pressure P [{self.imposed[0].unit}]"
        panel = chart("pressure", SECONDS, label, width, height, x_range=self.time)
        for quantity, color in zip(self.imposed, cycle(("black", *COLORS)), strict=False):
            named = {"legend_label": quantity.symbol} if several else {}
            panel.line("x", "y", source=self.pressures[quantity.column], color=color, width=1.3, **named)
        if several:
            legend_below(panel)
        return panel

    def _reading_chart(self, quantity: Quantity, width: int, height: int) -> figure:
        panel = chart(quantity.name, SECONDS, quantity.label, width, height, x_range=self.time)
        source = self.readings[quantity.column]
        panel.line("x", "y", source=source, color="black", width=1.3, legend_label=MEASURED)
        for number, name in enumerate(self.models):
            panel.line(
                "x", "y", source=self.predicted[name][quantity.column], color=self.models[name], width=1.8,
                line_dash=DASHES[number % len(DASHES)], legend_label=name,
            )  # fmt: skip
        legend_below(panel)
        return panel

    def _loop_chart(self, quantity: Quantity, width: int, height: int) -> figure:
        title = f"{quantity.symbol}–{self.over.symbol}, colored by the pressure's rate [{self.over.unit}/s]"
        panel = chart(title, self.over.label, quantity.label, width, height)
        panel.segment(
            "x0", "y0", "x1", "y1", source=self.segments[quantity.column], line_width="wide",
            line_color={"field": "rate", "transform": self.mapper},
        )  # fmt: skip
        for number, name in enumerate(self.models):
            panel.line(
                "x", "y", source=self.modeled[name][quantity.column], color=self.models[name], width=2,
                line_dash=DASHES[number % len(DASHES)], legend_label=name,
            )  # fmt: skip
        if self.models:
            legend_below(panel)
        panel.add_layout(ColorBar(color_mapper=self.mapper, width=10, padding=4), "right")
        return panel

    def show(self, trace: Trace) -> None:
        """Draws a stretch of a recording over time."""
        self.across.data = _over_time(trace.across)
        for column, source in self.pressures.items():
            source.data = _over_time(trace.imposed[column])
        for column, source in self.readings.items():
            source.data = _over_time(trace.measured[column])
        for name, sources in self.predicted.items():
            for column, source in sources.items():
                source.data = _over_time(trace.models[name][column])

    def show_loops(self, loops: dict[str, Loops], chosen: int, modeled: dict[str, dict[str, Loops]]) -> None:
        """Draws loops by their quantity's column; those of the recording with that number are thick. modeled: those
        that each model says of that recording."""
        self.mapper.high = max(shown.fastest for shown in loops.values())
        for column, source in self.segments.items():
            source.data = _segments(loops[column], chosen)
        for name, sources in self.modeled.items():
            for column, source in sources.items():
                loop = modeled[name][column]
                source.data = {"x": loop.pressure.tolist(), "y": loop.value.tolist()}


def _over_time(signal: Signal) -> dict[str, list[float]]:
    # Lists: Bokeh sends each array to a page in two messages of its own.
    return {"x": signal.time.tolist(), "y": signal.value.tolist()}


def _segments(loops: Loops, chosen: int) -> dict[str, list[float]]:
    """From point to point of each recording, with its color and width."""
    wide = np.where(loops.recording[loops.joined] == chosen, THICK, THIN)
    # Last, so that it lies on the others.
    order = np.argsort(wide, kind="stable")
    joined, fast, wide = loops.joined[order], loops.speed[order], wide[order]
    columns = (loops.pressure[joined], loops.value[joined], loops.pressure[joined + 1], loops.value[joined + 1])
    names = ("x0", "y0", "x1", "y1", "rate", "wide")
    return {name: values.tolist() for name, values in zip(names, (*columns, fast, wide), strict=True)}


def spectrum_chart(
    spectra: Mapping[str, Spectrum], colors: Mapping[str, str], width: int = 400, height: int = 330
) -> figure:
    """What models leave of one quantity, by the model's name, beside the noise that is stated."""
    *_, last = spectra.values()
    title = f"{last.quantity.name}: {LEFT}, by its frequency"
    log = {"x_axis_type": "log", "y_axis_type": "log"}
    panel = chart(title, HERTZ, f"power density [{last.unit}]", width, height, **log)
    for number, (name, spectrum) in enumerate(spectra.items()):
        panel.line(
            spectrum.frequency, spectrum.density, color=colors[name], width=2, legend_label=name,
            line_dash=DASHES[number % len(DASHES)],
        )  # fmt: skip
    if last.noise is not None:
        ends = [float(last.frequency[0]), float(last.frequency[-1])]
        panel.line(ends, [last.noise] * 2, color="black", width=1.5, line_dash="dashed", legend_label=STATED)
    legend_below(panel)
    return panel
