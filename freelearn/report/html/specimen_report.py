"""The page of a rubber's fit: which energy its tests ask for, curves, parameters, and how a fit takes it over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from bokeh.models import ColumnDataSource

from freelearn.common.display import COLORS, DisplayTable
from freelearn.common.formats import percent
from freelearn.data.specimen_schema import MODES
from freelearn.data.specimen_tests import timed
from freelearn.fitting.rubber_fit import RubberFit
from freelearn.report.html.chart_canvas import chart, hover, legend_below
from freelearn.report.html.html_page import Section, write_page
from freelearn.report.plots.specimen_plot import Trace, along_words, shades, traces
from freelearn.report.tables.specimen_tables import rubber_parameters

STRESSES = {"stress_mpa": "nominal stress P [MPa]", "stress_2_mpa": "nominal stress across, P₂ [MPa]"}
WIDTHS = (4, 2)


def report_specimen(
    path: Path,
    fits: Mapping[str, RubberFit],
    curves: pd.DataFrame,
    notes: Sequence[str],
    tables: Sequence[DisplayTable],
    compared: tuple[DisplayTable, str] | None,
    command: str,
) -> None:
    """Writes the page. fits: the neo-Hookean one, then that with effects, if there are some. curves: of
    specimen_tables. tables: errors by test, and of recordings the relaxations tried. compared: all combinations, and
    what they say. command: that takes the values over."""
    fit = list(fits.values())[-1]
    verdict = [compared[1]] if compared else [f"Fitted: {list(fits)[-1]}, E = {percent(fit.error, 2)} %."]
    sections = [Section("What the tests ask for", verdict, kind="verdict")]
    sections += [Section("To know before it is used", notes, kind="note")] if notes else []
    drawn = [f"Squares: measured. Lines: {', '.join(fits)}. Dashed: held out of the fit."]
    if timed(curves).any():
        lines = f"{list(fits)[-1]}, relaxation: {fit.rubber.relaxation.words}"
        drawn = [f"Dots, squares: measured. Lines: {lines}. Dashed: held out."]
    sections.append(
        Section("Stress against stretch", drawn, charts=_charts(curves, fits), numbers={"curves.csv": curves})
    )
    sections += [*map(Section.of_table, tables), Section("Parameters", tables=[rubber_parameters(fit)])]
    if compared:
        table = compared[0]
        sections.append(Section("All combinations of energies", [f"{table.title}."], [table], folded="the table"))
    told = ["A model of an actuator of this rubber takes the values over:"]
    sections.append(Section("In an actuator", told, code=command))
    write_page(path, "Rubber alone", False, sections)


def _charts(curves: pd.DataFrame, fits: Mapping[str, RubberFit]) -> list[Any]:
    """One for each mode and direction: measured stresses as squares, fits as lines, dashed where held out; of
    recordings two, over the stretch and over time."""
    modes = [mode for mode in next(iter(fits.values())).modes if mode in MODES]
    still = curves[~timed(curves)]
    charts = [
        _chart(still[still["mode"] == mode], mode, column, fits)
        for mode in modes
        for column in STRESSES
        if still.loc[still["mode"] == mode, column].notna().any()
    ]
    for mode in MODES:
        for column in STRESSES:
            if own := list(traces(curves, mode, column, fits)):
                charts += [_recorded(own, mode, column, over_time) for over_time in (False, True)]
    return charts


def _recorded(own: Sequence[Trace], mode: str, column: str, over_time: bool) -> Any:
    """Recordings of one mode: dots measured, lines fitted, dashed where held out."""
    x_words = "time since the recording's begin [s]" if over_time else along_words(mode)
    axis = "log" if over_time else "auto"
    drawn = chart(f"{mode.replace('_', ' ')}, recorded", x_words, STRESSES[column], 480, 380, x_axis_type=axis)
    marks = []
    for trace, color in zip(own, shades(len(own)), strict=True):
        x = trace.since if over_time else trace.x
        # A logarithm has no place for the begin.
        shown = x > 0 if over_time else np.ones(len(x), dtype=bool)
        points = {"x": x[shown], "y": trace.measured[shown], "name": np.full(shown.sum(), trace.name)}
        dots = drawn.scatter("x", "y", source=ColumnDataSource(points), size=3, color=color, legend_label=trace.name)
        drawn.line(
            x[shown], trace.expected[shown], color=color, line_width=1.5, legend_label=trace.name,
            line_dash="solid" if trace.fitted else "dashed",
        )  # fmt: skip
        marks.append(dots)
    hover(drawn, [("", "@name"), ("stress", "@y{0.0000} MPa")], marks)
    legend_below(drawn)
    return drawn


def _chart(own: pd.DataFrame, mode: str, column: str, fits: Mapping[str, RubberFit]) -> Any:
    errors = " → ".join(percent(fit.modes[mode].error, 1) for fit in fits.values())
    drawn = chart(f"{mode.replace('_', ' ')}: E = {errors} %", "stretch λ [–]", STRESSES[column], 390, 340)
    measured = own[own["source"] == "measured"]
    points = ColumnDataSource({"x": measured["stretch"].to_numpy(), "y": measured[column].to_numpy()})
    marks = drawn.scatter("x", "y", source=points, marker="square", size=6, color="black", legend_label="measured")
    hover(drawn, [("stretch", "@x{0.000}"), ("stress", "@y{0.0000} MPa")], [marks])
    for (name, fit), color, width in zip(fits.items(), COLORS, WIDTHS, strict=False):
        dash = "solid" if fit.modes[mode].fitted else "dashed"
        for _, line in own[own["source"] == name].groupby("specimen", sort=False):
            x, y = line["stretch"].to_numpy(), line[column].to_numpy()
            label = "with effects" if name.startswith("with ") else name
            drawn.line(x, y, color=color, line_width=width, line_dash=dash, legend_label=label)
    legend_below(drawn)
    return drawn
