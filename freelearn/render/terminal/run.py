"""What a run shows in the terminal at its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from freelearn.measurements.plausibility import units_apart
from freelearn.render.terminal.table import rich_table
from freelearn.results.comparison import comparison_table
from freelearn.results.formats import sentence
from freelearn.results.origin import Origin
from freelearn.results.run import Run
from freelearn.results.run_tables import error_table, misfit_lines, parameter_notes, row_notes, run_parameters

MOST_FAILURES = 3


def show_run(console: Console, run: Run, folder: Path, warnings: Sequence[str], origin: Origin) -> None:
    """Units that look wrong, before any error; errors by test set, parameters with 95 % intervals, what else to know,
    and where the files are."""

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False)

    units, warnings = units_apart(warnings)
    for warning in units:
        say(f"! {warning}")
    errors = error_table(run)
    console.print(rich_table(replace(errors, title=f"{errors.title} ({origin.provenance.kind})")))
    if run.comparison:
        console.print(rich_table(comparison_table(run.comparison)))
    parameters = run_parameters(run)
    console.print(parameters if isinstance(parameters, str) else rich_table(parameters))
    floor, *failures = misfit_lines(run, MOST_FAILURES) or [""]
    if floor:
        console.print(floor, markup=False, highlight=False, soft_wrap=True)
    if failures:
        say("Where this one fails, worst first:")
        for line in failures:
            say(f"  · {line}")
    for note in [*row_notes(run), *parameter_notes(run), *warnings]:
        say(f"! {sentence(note)}")
    # Printed plainly: a wrapped or colored path cannot be copied.
    console.print(f"files: {folder}", markup=False, highlight=False, soft_wrap=True)
