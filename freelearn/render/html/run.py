"""report.html of one run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.models.base import Model
from freelearn.render.html.charts.curves import CurveCharts
from freelearn.render.html.charts.parity import parity_charts, parity_numbers
from freelearn.render.html.charts.residual_strip import residual_strips
from freelearn.render.html.charts.residuals import ResidualCharts
from freelearn.render.html.page import Section, number, percent, sentence, write_page
from freelearn.render.html.provenance import provenance_section
from freelearn.render.png.curves import curve_numbers
from freelearn.render.png.residual_map import MOST_SAMPLES, residual_table
from freelearn.results.curve import StateCurves
from freelearn.results.fit_report import INTERVAL, effect_notes, notes
from freelearn.results.run import Run
from freelearn.results.run_files import counts
from freelearn.results.states import state_title


def report_run(
    run: Run,
    folder: Path,
    about: dict[str, Any],
    command: str,
    own: pd.DataFrame | None = None,
    shown: Sequence[StateCurves] = (),
) -> None:
    """Writes report.html. about: what results.json holds beside the outcome. own: rows of the samples that were fitted,
    in the columns of predictions.csv, and shown: states of them with their curves, for charts; None for none."""
    simulated = bool(about["data"]["simulated"])
    effects = [e.name for e in run.model.effects]
    title = " + ".join([run.model.name, *effects]) + f", fitted on {run.train}"
    sections = [_errors(run), *_comparison(about.get("comparison")), _parameters(run)]
    if "failures" in about:
        floor = f"A perfect model would have E = {percent(about['noise_floor'])} % on its training set's test rows."
        lines = [floor]
        lines += [sentence(f["sentence"]) for f in about["failures"]]
        sections.append(Section("Where it fails, worst first", lines))
    if own is not None:
        sections += [*_curves(shown), *residual_sections(own, ""), _parity(own)]
    facts = {"seed": about["seed"], "split": about["split"], "fit": f"{run.method}, {run.message}"}
    sections.append(provenance_section(about["data"], command, facts))
    write_page(folder / "report.html", title, simulated, sections)


def _errors(run: Run) -> Section:
    table = pd.DataFrame(
        [
            [name + (" (training set)" if name == run.train else ""), *map(percent, (e.E, e.E_force, e.E_moment)), e.n]
            for name, e in run.errors.items()
        ],
        columns=["test set", "E %", "force %", "moment %", "rows"],
    )
    explained = "E = √mean(((F−F̂)/max|F|)² + ((M−M̂)/max|M|)²) over a set's test rows."
    rows = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in counts(run).items())
    return Section("How good it is", [explained, f"Rows: {rows}."], table)


def _comparison(comparison: dict[str, dict[str, float]] | None) -> list[Section]:
    if not comparison:
        return []
    table = pd.DataFrame(
        [[name, percent(pair["without"]), percent(pair["with"])] for name, pair in comparison.items()],
        columns=["test set", "E without %", "E with %"],
    )
    return [Section("Without and with the effects", ["Whole kinematic states held out of both fits."], table)]


def _parameters(run: Run) -> Section:
    heading = "Parameters"
    if not run.model.declared:
        return Section(heading, [f"{len(run.model.vector())} weights and biases, listed in fit_report.txt."])
    error = dict(zip(run.uncertainty.names, run.uncertainty.stderr, strict=True)) if run.uncertainty else {}
    table = parameter_table(run.model, run.model.scalars(), error)
    remarks = [*notes(run.model, run.start), *effect_notes(run.model, run.uncertainty)] if run.uncertainty else []
    return Section(heading, remarks, table)


def parameter_table(model: Model, values: Mapping[str, float], stderr: Mapping[str, float]) -> pd.DataFrame:
    """Physical parameters with 95 % intervals, as cells; a dash for an unknown standard error."""
    rows = []
    for name, value in values.items():
        error = float(stderr.get(name, math.nan))
        ends = [number(value + side * INTERVAL * error) for side in (-1, 1)]
        rows.append([name, number(value), number(error, 2), *ends, model.declared[name].unit])
    return pd.DataFrame(rows, columns=["parameter", "value", "± stderr", "95 % from", "to", "unit"])


def _curves(shown: Sequence[StateCurves]) -> list[Section]:
    return [
        curve_section(measured, curves, f"Loads at the {rank} predicted state")
        for (measured, curves), rank in zip(shown, ("best", "middling", "worst"), strict=False)
    ]


def curve_section(measured: pd.DataFrame, curves: dict[str, pd.DataFrame], heading: str) -> Section:
    """F–P, M–P and F–M of one state."""
    charts = CurveCharts(list(curves))
    charts.show(measured, curves)
    where = state_title(measured)
    name = "curves_" + where.replace(",", "").replace("°", "deg").replace(" ", "_") + ".csv"
    note = "Squares: measured, open where the pressure fell. Faint lines: beyond the measured pressures."
    return Section(f"{heading}: {where}", [note], charts=charts.panels, numbers={name: curve_numbers(measured, curves)})


def residual_sections(own: pd.DataFrame, when: str) -> list[Section]:
    """Maps of the mean residual, one pair per sample. when: a word before the heading, such as before or after."""
    table = residual_table(own)
    panels = []
    samples = sorted(table["sample"].unique())
    if len(samples) == 1:
        charts = ResidualCharts()
        charts.show(table)
        panels = charts.panels
    else:
        panels = residual_strips(table[table["sample"].isin(samples[:MOST_SAMPLES])])
    lines = ["Mean over pressure at each length and twist; grey cells have no usable row."]
    if len(samples) > MOST_SAMPLES:
        lines.append(f"First {MOST_SAMPLES} of {len(samples)} samples.")
    heading = f"{when}: where it is wrong" if when else "Where it is wrong"
    return [Section(heading, lines, charts=panels, numbers={f"residuals{'_' + when if when else ''}.csv": table})]


def _parity(own: pd.DataFrame) -> Section:
    shown = parity_numbers(own)
    return Section("Predicted against measured", charts=parity_charts(shown), numbers={"parity.csv": shown})
