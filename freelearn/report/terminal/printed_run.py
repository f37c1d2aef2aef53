"""What the terminal shows of a run, of answers and of a plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from freelearn.common.formats import sentence
from freelearn.data.table.unit_suspicions import units_apart
from freelearn.queries.answers import Answers
from freelearn.queries.fitted_model import FittedModel
from freelearn.records.plan_record import Plan
from freelearn.records.provenance import Origin
from freelearn.records.run import Run, comparison_table
from freelearn.report.tables.answer_tables import answer_lines, answers_table
from freelearn.report.tables.plan_tables import expected_table, mounting_table, parameter_rows, plan_lines
from freelearn.report.tables.run_tables import error_table, misfit_lines, parameter_notes, row_notes, run_parameters
from freelearn.report.terminal.printed_tables import print_line, print_words, rich_table, show_files

MOST_FAILURES = 3


def show_run(console: Console, run: Run, folder: Path, warnings: Sequence[str], origin: Origin) -> None:
    """Units that look wrong, before any error; errors by test set, parameters with 95 % intervals, what else to know,
    and where the files are."""

    def say(text: str) -> None:
        print_words(console, text)

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
        print_line(console, floor)
    if failures:
        say("Where this one fails, worst first:")
        for line in failures:
            say(f"  · {line}")
    for note in [*row_notes(run), *parameter_notes(run), *warnings]:
        say(f"! {sentence(note)}")
    show_files(console, folder, report="report.html")


def show_answers(
    console: Console, answers: Answers, fitted: FittedModel, warnings: Sequence[str], folder: Path
) -> None:
    """The first rows, how many have which status, and where the files are."""
    for warning in warnings:
        print_words(console, f"! {warning}")
    console.print(rich_table(answers_table(answers)))
    for line in answer_lines(answers, fitted):
        print_words(console, f"  · {line}")
    show_files(console, folder, answers="answers.csv", picture="answers.png")


SHOWN = 20


def show_plan(console: Console, plan: Plan, folder: Path) -> None:
    """Tables and sentences."""
    console.print(rich_table(mounting_table(plan, SHOWN)))
    if plan.goal != "halve":
        console.print(rich_table(expected_table(plan)))
    if plan.parameters:
        console.print(rich_table(parameter_rows(plan)))
    for line in plan_lines(plan):
        print_words(console, line)
    show_files(console, folder, plan="plan.csv", picture="plan_places.png")
