"""What predict shows in the terminal: the first answers, and what became of all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from freelearn.render.terminal.table import rich_table
from freelearn.results.answers import Answers
from freelearn.results.answers_tables import answers_table, told
from freelearn.results.fitted_model import FittedModel


def show_answers(
    console: Console, answers: Answers, fitted: FittedModel, warnings: Sequence[str], folder: Path
) -> None:
    """The first rows, how many have which status, and where the files are."""
    for warning in warnings:
        console.print(f"! {warning}", markup=False, highlight=False)
    console.print(rich_table(answers_table(answers)))
    for line in told(answers, fitted):
        console.print(f"  · {line}", markup=False, highlight=False)
    console.print(f"files: {folder}", markup=False, highlight=False, soft_wrap=True)
