"""The page of a rubber's fit: which energy its tests ask for, curves, parameters, and how a fit takes it over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from bokeh.models import ColumnDataSource

from freelearn.common.display import COLORS
from freelearn.common.formats import percent
from freelearn.fitting.rubber_fit import RubberFit
from freelearn.report.html.chart_canvas import chart, hover, legend_below
from freelearn.report.html.html_page import Section, write_page
from freelearn.report.tables.specimen_tables import combination_table, mode_table, rubber_parameters

STRESSES = {"stress_mpa": "nominal stress P [MPa]", "stress_2_mpa": "nominal stress across, P₂ [MPa]"}
WIDTHS = (4, 2)


def report_specimen(
    path: Path,
    fits: Mapping[str, RubberFit],
    curves: pd.DataFrame,
    notes: Sequence[str],
    compared: tuple[pd.DataFrame, str] | None,
    result: Path,
) -> None:
    """Writes the page. fits: the neo-Hookean one, then that with effects, if there are some. curves: of
    specimen_tables. compared: all combinations, and what they say. result: specimen.json."""
    fit = list(fits.values())[-1]
    verdict = [compared[1]] if compared else [f"Fitted: {list(fits)[-1]}, E = {percent(fit.error, 2)} %."]
    sections = [Section("What the tests ask for", verdict, kind="verdict")]
    sections += [Section("To know before it is used", notes, kind="note")] if notes else []
    drawn = [f"Squares: measured. Lines: {', '.join(fits)}. Dashed: held out of the fit."]
    sections.append(
        Section("Stress against stretch", drawn, charts=_charts(curves, fits), numbers={"curves.csv": curves})
    )
    sections += [Section.of_table(mode_table(fits)), Section("Parameters", tables=[rubber_parameters(fit)])]
    if compared:
        table = combination_table(compared[0])
        sections.append(Section("All combinations of energies", [f"{table.title}."], [table], folded="the table"))
    effects = [effect.name for effect in fit.rubber.effects]
    told = ["A model of an actuator of this rubber takes the values over:"]
    words = ["python train.py train=constituent", f"constituent={result}"]
    words += [f"effects=[{','.join(effects)}]"] if effects else []
    sections.append(Section("In an actuator", told, code=" ".join(words)))
    write_page(path, "Rubber alone", False, sections)


def _charts(curves: pd.DataFrame, fits: Mapping[str, RubberFit]) -> list[Any]:
    """One for each mode and direction: measured stresses as squares, fits as lines, dashed where held out."""
    modes = next(iter(fits.values())).modes
    return [
        _chart(curves[curves["mode"] == mode], mode, column, fits)
        for mode in modes
        for column in STRESSES
        if curves.loc[curves["mode"] == mode, column].notna().any()
    ]


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
