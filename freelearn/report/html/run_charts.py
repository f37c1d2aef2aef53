"""The sections of a report that hold charts: curves, residuals, predicted against measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from freelearn.common.display import COLORS
from freelearn.common.formats import sentence
from freelearn.data.beds import bed_of
from freelearn.data.logs import RUN, TIME, is_log
from freelearn.queries.curves.curve_panels import LOOSE, SUSPECTED, curve_numbers, panels_of
from freelearn.queries.curves.curve_rows import measured_quantities, plane, pressures, sweep, words
from freelearn.queries.curves.log_spectra import ABOUT_SPECTRA, Spectrum, spectrum_table
from freelearn.queries.curves.log_traces import ABOUT_LOOPS, measured_loops, predicted_loops, trace_of, worst_recording
from freelearn.queries.curves.model_curves import StateCurves, has_band
from freelearn.queries.curves.shown_states import state_title
from freelearn.report.html.curve_charts import CurveCharts
from freelearn.report.html.html_page import Section
from freelearn.report.html.log_charts import LogCharts, spectrum_chart
from freelearn.report.html.parity_chart import parity_charts
from freelearn.report.html.residual_charts import ResidualCharts, residual_strips
from freelearn.report.tables.picture_numbers import parity_numbers
from freelearn.report.tables.residual_tables import Limits, drawn, residual_table, scale_limits, shown_samples

# In charts of a log.
MODEL = {"model": COLORS[1]}


def chart_sections(own: pd.DataFrame, shown: Sequence[StateCurves], spectra: Sequence[Spectrum] = ()) -> list[Section]:
    """The charts of one run. own: rows in the columns of predictions.csv; shown: the best, a middling and the worst
    predicted state with their curves; spectra: of what is left of a log, whose recordings take the states' place."""
    ranks = zip(shown, ("best", "middling", "worst"), strict=False)
    if is_log(own):
        curves = [recording_section(own), *spectra_section(spectra)]
    else:
        curves = [curve_section(measured, lines, f"at the {rank} predicted state") for (measured, lines), rank in ranks]
    numbers = parity_numbers(own)
    imposed = [*bed_of(own).state, *pressures(own)]
    charts = parity_charts(numbers, measured_quantities(own), imposed)
    lines = [] if charts else ["The model answers no row."]
    parity = Section("Predicted against measured", lines, charts=charts, numbers={"parity.csv": numbers})
    return [*curves, residual_section(own), parity]


def recording_section(own: pd.DataFrame) -> Section:
    """The recording of a log that is predicted worst, along its time, and the loops of its sample."""
    rows, sample = worst_recording(own)
    known, over = measured_quantities(sample), sweep(sample).over
    charts = LogCharts(MODEL, pressures(sample), known, over)
    charts.time.update(start=float(rows[TIME].iloc[0]), end=float(rows[TIME].iloc[-1]))
    (model,) = MODEL
    trace = trace_of(rows, over, {model: rows})
    charts.show(trace)
    chosen = list(dict.fromkeys(sample[RUN])).index(rows[RUN].iloc[0])
    charts.show_loops(measured_loops(sample, over), chosen, {model: predicted_loops(rows, over)})
    heading = f"Along the recording that is predicted worst: sample {rows['sample'].iloc[0]}, run {rows[RUN].iloc[0]}"
    lines = [ABOUT_LOOPS, *([trace.told] if trace.told else [])]
    return Section(heading, lines, charts=[*charts.times, *charts.loops])


def spectra_section(spectra: Sequence[Spectrum]) -> list[Section]:
    """What is left of a log by its frequency, beside the noise; none where no recording is long enough."""
    if not spectra:
        return []
    (model,) = MODEL
    charts = [spectrum_chart({model: spectrum}, MODEL) for spectrum in spectra]
    heading, numbers = "What is left, by its frequency", {"spectra.csv": spectrum_table(spectra)}
    return [Section(heading, [ABOUT_SPECTRA], charts=charts, numbers=numbers)]


def curve_section(measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame], when: str) -> Section:
    """F–P, M–P and F–M of one state, or curves of what else was measured. measured: its rows; curves: frames of
    model_curve, by the model's name. when: of the heading, behind what is shown."""
    charts = CurveCharts(list(curves), shown=panels_of(measured))
    charts.show(measured, curves)
    where, heading = state_title(measured), f"{words(measured_quantities(measured))} {when}"
    plain = {",": "", "°": "deg", " ": "_", "·": ""}
    name = "curves_" + "".join(plain.get(letter, letter) for letter in where) + ".csv"
    numbers = curve_numbers(measured, curves)
    note = "Squares: measured, open where the pressure fell. Faint lines: beyond the measured pressures."
    banded = [line.line[1] for line in charts.shown if line.banded]
    if any(has_band(curve, column) for curve in curves.values() for column in banded):
        note += " Shaded: where a new measurement lies with 95 % probability; nothing tells it beyond those pressures."
    if sweep(measured).held:
        note += " The other actuators' pressures are those imposed: where they wander, a line has a kink."
    if (numbers["what"] == LOOSE).any():
        note += " Diamonds: the tube hangs loose; a push that is predicted there costs nothing."
    if (numbers["what"] == SUSPECTED).any():
        note += " Crosses: suspected readings, at the edge where they lie beyond it."
    where = where.replace("-", "−")
    return Section(f"{heading}: {where}", [note], charts=charts.panels, numbers={name: numbers})


def residual_section(predictions: pd.DataFrame, when: str = "", limits: Limits | None = None) -> Section:
    """Maps of the mean residual. when: a word before the heading, such as before or after. limits: ends of the scales
    that they share with other maps, of scale_limits; by default their own."""
    over, shown = plane(predictions), measured_quantities(predictions)
    ends = scale_limits([predictions], over, shown) if limits is None else limits
    table = residual_table(predictions, over)
    samples, note = shown_samples(table)
    table, fewer = drawn(table)
    if len(samples) == 1:
        charts = ResidualCharts(plane=over, quantities=shown)
        charts.show(table, [ends[samples[0], quantity.column] for quantity in shown])
        panels = charts.panels
    else:
        panels = residual_strips(table, samples, over, shown, ends)
    places = " and ".join(f"{quantity.name} {quantity.symbol}" for quantity in over)
    mean = "Mean over pressure" if over == bed_of(predictions).state else "Mean"
    lines = [f"{mean} at each {places}; gray cells have no usable row."]
    if limits is not None:
        lines[0] += " Before and after share one scale."
    lines += [sentence(part) for part in (note, fewer) if part]
    heading = f"{when.capitalize()}: where it is wrong" if when else "Where it is wrong"
    return Section(heading, lines, charts=panels, numbers={f"residuals{'_' + when if when else ''}.csv": table})
