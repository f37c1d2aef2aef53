"""report.html of one run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from freelearn.queries.curves.log_spectra import Spectrum
from freelearn.queries.curves.model_curves import StateCurves
from freelearn.records.provenance import Origin
from freelearn.records.run import Run, comparison_table
from freelearn.report.html.html_page import FOR_THE_LAB_BOOK, Section, provenance_section, write_page
from freelearn.report.tables.lab_notes import run_note
from freelearn.report.tables.run_tables import (
    error_table,
    explained,
    misfit_lines,
    parameter_notes,
    row_counts,
    run_parameters,
)


def report_run(
    run: Run,
    folder: Path,
    origin: Origin,
    command: str,
    own: pd.DataFrame | None = None,
    shown: Sequence[StateCurves] = (),
    spectra: Sequence[Spectrum] = (),
) -> None:
    """Writes report.html. own: rows of the samples that were fitted, in the columns of predictions.csv, and shown:
    states of them with their curves, for charts; None for none; spectra: of
    what is left of a log. command: the shell command that repeats the run."""
    sections = [Section("How good it is", [explained(run), row_counts(run)], [error_table(run)])]
    sections.append(Section(FOR_THE_LAB_BOOK, [run_note(run, origin)], kind="note"))
    if run.comparison:
        sections.append(Section.of_table(comparison_table(run.comparison)))
    sections.append(_parameters(run))
    if failures := misfit_lines(run):
        title = "Where it fails, worst first" if len(failures) > 1 else "How small the error could be"
        sections.append(Section(title, failures))
    if own is not None:
        # Bokeh takes a second to import: a report without charts does without.
        from freelearn.report.html.run_charts import chart_sections

        sections += chart_sections(own, shown, spectra)
    facts = {"seed": origin.seed, "split": origin.split, "fit": f"{run.method}, {run.message}"}
    sections.append(provenance_section(origin.provenance, command, facts))
    title = f"{run.title}, fitted on {run.train}"
    write_page(folder / "report.html", title, origin.provenance.simulated, sections)


def _parameters(run: Run) -> Section:
    table = run_parameters(run)
    if isinstance(table, str):
        return Section("Parameters", [table, *parameter_notes(run)])
    return Section("Parameters", parameter_notes(run), [table])
