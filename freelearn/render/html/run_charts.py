"""The sections of a report that hold charts: load curves, residuals, predicted against measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from freelearn.render.html.charts.curves import CurveCharts
from freelearn.render.html.charts.parity import parity_charts
from freelearn.render.html.charts.residual_strip import residual_strips
from freelearn.render.html.charts.residuals import ResidualCharts
from freelearn.render.html.page import Section
from freelearn.results.curve import StateCurves
from freelearn.results.curve_panels import SUSPECTED, curve_numbers
from freelearn.results.formats import sentence
from freelearn.results.parity import parity_numbers
from freelearn.results.residuals import residual_table, shown_samples
from freelearn.results.states import state_title


def chart_sections(own: pd.DataFrame, shown: Sequence[StateCurves]) -> list[Section]:
    """The charts of one run. own: rows in the columns of predictions.csv; shown: the best, a middling and the worst
    predicted state with their curves."""
    ranks = zip(shown, ("best", "middling", "worst"), strict=False)
    curves = [
        curve_section(measured, lines, f"Loads at the {rank} predicted state") for (measured, lines), rank in ranks
    ]
    numbers = parity_numbers(own)
    parity = Section("Predicted against measured", charts=parity_charts(numbers), numbers={"parity.csv": numbers})
    return [*curves, residual_section(own), parity]


def curve_section(measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame], heading: str) -> Section:
    """F–P, M–P and F–M of one state. measured: its rows; curves: frames of model_curve, by the model's name."""
    charts = CurveCharts(list(curves))
    charts.show(measured, curves)
    where = state_title(measured)
    name = "curves_" + where.replace(",", "").replace("°", "deg").replace(" ", "_") + ".csv"
    numbers = curve_numbers(measured, curves)
    note = "Squares: measured, open where the pressure fell. Faint lines: beyond the measured pressures."
    if (numbers["what"] == SUSPECTED).any():
        note += " Crosses: suspected readings, at the edge where they lie beyond it."
    return Section(f"{heading}: {where}", [note], charts=charts.panels, numbers={name: numbers})


def residual_section(predictions: pd.DataFrame, when: str = "") -> Section:
    """Maps of the mean residual. when: a word before the heading, such as before or after."""
    table = residual_table(predictions)
    samples, note = shown_samples(table)
    if len(samples) == 1:
        charts = ResidualCharts()
        charts.show(table)
        panels = charts.panels
    else:
        panels = residual_strips(table, samples)
    lines = ["Mean over pressure at each length and twist; gray cells have no usable row."]
    if note:
        lines.append(sentence(note))
    heading = f"{when}: where it is wrong" if when else "Where it is wrong"
    return Section(heading, lines, charts=panels, numbers={f"residuals{'_' + when if when else ''}.csv": table})
