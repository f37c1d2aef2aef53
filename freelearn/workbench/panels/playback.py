"""A log beside the model: a recording over time with a window and a cursor that plays, its loops, and spectra."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
import panel as pn
from bokeh.models import CustomJS, Div, Label, RangeSlider, Select, Slider, Span, Toggle

from freelearn.data.logs import RUN, TIME
from freelearn.queries.curves.curve_rows import measured_quantities, pressures, sweep
from freelearn.queries.curves.log_spectra import ABOUT_SPECTRA
from freelearn.queries.curves.log_traces import ABOUT_LOOPS, Loops, measured_loops, predicted_loops, trace_of
from freelearn.report.html.log_charts import LogCharts, spectrum_chart
from freelearn.workbench.panels.widgets import say, together, wide, words
from freelearn.workbench.state.fitted import Fitted

KEYS = ["sample", RUN, TIME]
# After the window has moved the samples in it are drawn anew [ms]: while it moves, those that are there are enough.
SETTLED = 150
# So many steps of the cursor along a recording.
STEPS = 2000
PLAY = "Play"
SPEEDS = [("1", "real time"), ("5", "5 times as fast"), ("25", "25 times as fast")]
WIDTH, HEIGHT, LOOP_HEIGHT = 480, 210, 330
# The instant of the cursor on a loop. What moves with it is drawn over everything else, which then stays as it is; and
# it is no glyph, whose data would have the ranges of the chart looked at.
RING = "○"
MARKED: dict[str, Any] = {
    "level": "overlay", "text_align": "center", "text_baseline": "middle", "text_font_size": "22px",
    "text_font_style": "bold",
}  # fmt: skip
TWO = "repeat(2, minmax(0, 1fr))"

# The last sample drawn before the cursor, in every chart; in the browser alone, so that it follows the mouse.
_MOVED = """
    const t = cursor.value
    const at = source => {
        const {x, y} = source.data
        let low = 0, high = x.length - 1
        while (low < high) { const middle = (low + high + 1) >> 1; x[middle] <= t ? low = middle : high = middle - 1 }
        return x.length ? y[low] : NaN
    }
    const shown = value => Number.isFinite(value) ? Number(value.toPrecision(4)).toString().replace("-", "\u2212") : "–"
    for (const span of spans) span.location = t
    const p = at(across)
    const told = [`t = ${shown(t)} s`, `${pressure} = ${shown(p)} ${unit}`]
    quantities.forEach((about, i) => {
        const values = about.sources.map(at)
        marks[i].forEach((ring, k) => ring.setv({x: p, y: values[k], visible: Number.isFinite(p + values[k])}))
        const models = values.slice(1).map((value, k) => `${names[k]} ${shown(value)}`).join(", ")
        told.push(`${about.symbol} = ${shown(values[0])} ${about.unit} (${models})`)
    })
    readout.text = told.join(" &nbsp; ")
"""
_PLAYED = """
    cb_obj.label = cb_obj.active ? "Pause" : "Play"
    if (!cb_obj.active) return
    if (cursor.value >= time.end || cursor.value < time.start) cursor.value = time.start
    let last = performance.now()
    const go = () => {
        if (!cb_obj.active) return
        const now = performance.now(), next = cursor.value + (now - last) / 1000 * Number(speed.value)
        last = now
        cursor.value = Math.min(next, time.end)
        if (next >= time.end) cb_obj.active = false
        else setTimeout(go, 40)
    }
    setTimeout(go, 40)
"""


class Playback:
    """The part of the comparison that a log has in the place of curves at kinematic states."""

    def __init__(self, colors: Mapping[str, str]) -> None:
        """colors: of the models, by their names."""
        self.colors = colors
        self.told = words()
        self.controls, self.charts = pn.Column(sizing_mode="stretch_width"), together()
        self.view = pn.Column(self.controls, self.charts, self.told, sizing_mode="stretch_width", visible=False)
        # What the charts are of, and the recording that they show.
        self.of: tuple[Any, ...] = ()
        self.drawn: LogCharts | None = None
        self.rows = pd.DataFrame()
        self.models: dict[str, pd.DataFrame] = {}
        self.waiting: Any = None
        self.runs: list[Any] = []
        self.loops: dict[str, Loops] = {}

    def show(self, models: dict[str, Fitted], sample: int, rows: Any) -> None:
        """models: the fits whose predictions are drawn, by their names, the latest last; rows: positions of a recording
        in the latest one's table."""
        now = list(models.values())[-1]
        self.rows = now.table.iloc[rows]
        self.models = {name: _same_rows(fit, self.rows) for name, fit in models.items()}
        # Of many samples all that is the same for each recording takes most of the time.
        of = (tuple((name, fit.folder, id(fit)) for name, fit in models.items()), sample)
        if of != self.of:
            self.of = of
            self._build(models, now.table[now.table["sample"] == sample])
        assert self.drawn is not None
        time = self.rows[TIME]
        self._place(float(time.iloc[0]), float(time.iloc[-1]))
        self._draw()
        modeled = {name: predicted_loops(table, self.over) for name, table in self.models.items()}
        self.drawn.show_loops(self.loops, self.runs.index(self.rows[RUN].iloc[0]), modeled)

    def _build(self, models: dict[str, Fitted], whole: pd.DataFrame) -> None:
        """Charts and controls of these models and a sample's rows."""
        known, self.over = measured_quantities(whole), sweep(whole).over
        self.runs = whole[RUN].unique().tolist()
        self.loops = measured_loops(whole, self.over)
        self.drawn = charts = LogCharts(
            {name: self.colors[name] for name in models}, pressures(whole), known, self.over, WIDTH, HEIGHT, LOOP_HEIGHT
        )
        self.cursor = Slider(start=0, end=1, value=0, step=0.1, title="cursor at time t [s]", format="0[.]00")
        self.window = RangeSlider(start=0, end=1, value=(0, 1), step=0.1, title="time window [s]", format="0[.]00")
        self.play, self.speed = (
            Toggle(label=PLAY, width=90),
            Select(title="speed", options=SPEEDS, value="1", width=150),
        )
        self.readout = Div(text="", sizing_mode="stretch_width")
        self._link(charts)
        for slider in (self.cursor, self.window):
            # A handle at its end reaches beyond the track.
            slider.sizing_mode, slider.margin = "stretch_width", (0, 14)
        played = [pn.pane.Bokeh(box, width=box.width, align="end") for box in (self.play, self.speed)]
        said, *sliding = (
            pn.pane.Bokeh(part, sizing_mode="stretch_width", align="end")
            for part in (self.readout, self.cursor, self.window)
        )
        self.controls.objects = [pn.Row(*played, said, sizing_mode="stretch_width"), *sliding]
        spectra = _spectra(models, self.colors)
        times = pn.Column(*map(wide, charts.times), sizing_mode="stretch_width", styles={"flex": "1 1 560px"})
        grid = f"div[id^=flexbox] {{ display: grid !important; grid-template-columns: {TWO}; align-items: start; }}"
        others = pn.FlexBox(
            *map(wide, [*charts.loops, *spectra]), sizing_mode="stretch_width", stylesheets=[grid],
            styles={"flex": "1 1 640px", "min-width": "0"},
        )  # fmt: skip
        self.charts.objects = [times, others]

    def _link(self, charts: LogCharts) -> None:
        """Has the cursor, the window and the charts follow each other in the browser."""
        spans = [Span(dimension="height", line_color="#8a1f00", line_width=1.5, level="overlay") for _ in charts.times]
        for panel, span in zip(charts.times, spans, strict=True):
            panel.add_layout(span)
        colors = ["black", *charts.models.values()]
        marks = [
            [Label(x=0, y=0, text=RING, text_color=color, visible=False, **MARKED) for color in colors]
            for _ in charts.measured
        ]
        for panel, rings in zip(charts.loops, marks, strict=True):
            for ring in rings:
                panel.add_layout(ring)
        about = [
            {"symbol": q.symbol, "unit": q.unit,
             "sources": [charts.readings[q.column], *(charts.predicted[name][q.column] for name in charts.models)]}
            for q in charts.measured
        ]  # fmt: skip
        args = {
            "cursor": self.cursor, "across": charts.across, "spans": spans, "marks": marks, "quantities": about,
            "names": list(charts.models), "readout": self.readout, "pressure": self.over.symbol,
            "unit": self.over.unit,
        }  # fmt: skip
        moved = CustomJS(args=args, code=_MOVED)
        self.cursor.js_on_change("value", moved)
        charts.across.js_on_change("data", moved)
        time = charts.time
        self.window.js_on_change(
            "value", CustomJS(args={"time": time}, code="time.setv({start: cb_obj.value[0], end: cb_obj.value[1]})")
        )
        both = CustomJS(args={"slider": self.window}, code="slider.value = [cb_obj.start, cb_obj.end]")
        for end in ("start", "end"):
            time.js_on_change(end, both)
            time.on_change(end, lambda attr, old, new: self._moved())
        self.play.js_on_change(
            "active", CustomJS(args={"cursor": self.cursor, "time": time, "speed": self.speed}, code=_PLAYED)
        )

    def _place(self, first: float, last: float) -> None:
        """The whole recording in the window, the cursor at its begin."""
        assert self.drawn is not None
        last = last if last > first else first + 1.0
        step = (last - first) / STEPS
        self.cursor.update(start=first, end=last, step=step, value=first)
        self.window.update(start=first, end=last, step=step, value=(first, last))
        self.drawn.time.update(start=first, end=last)

    def _moved(self) -> None:
        """Draws the samples of the window anew, once it has come to rest."""
        document = pn.state.curdoc
        if document is None or self.waiting is not None:
            return
        self.waiting = document.add_timeout_callback(self._settle, SETTLED)

    def _settle(self) -> None:
        self.waiting = None
        with pn.io.hold():
            self._draw()

    def _draw(self) -> None:
        assert self.drawn is not None
        trace = trace_of(self.rows, self.over, self.models, (self.drawn.time.start, self.drawn.time.end))
        self.drawn.show(trace)
        say(self.told, [line for line in (trace.told, ABOUT_LOOPS, ABOUT_SPECTRA) if line], "quiet")


def _same_rows(fit: Fitted, rows: pd.DataFrame) -> pd.DataFrame:
    """Of a fit's table the rows of the same samples, of the same recordings at the same times; blank where it has
    none: a search looks at some rows of many."""
    if fit.table.index.isin(rows.index).sum() == len(rows):
        own = fit.table.loc[rows.index]
        if own[KEYS].equals(rows[KEYS]):
            return own
    found = fit.table.merge(rows[KEYS], on=KEYS, how="right").set_index(rows.index)
    return found.fillna({"status": "", "buckled": 0})


def _spectra(models: dict[str, Fitted], colors: Mapping[str, str]) -> list[Any]:
    """A chart for each quantity, of all fits."""
    every = {name: {s.quantity: s for s in fit.spectra} for name, fit in models.items()}
    quantities = dict.fromkeys(q for spectra in every.values() for q in spectra)
    return [
        spectrum_chart({name: own[q] for name, own in every.items() if q in own}, colors, WIDTH, LOOP_HEIGHT)
        for q in quantities
    ]
