"""What plan shows in the terminal: where to measure, and what is expected of it."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from freelearn.render.terminal.table import rich_table
from freelearn.results.plan import Plan
from freelearn.results.plan_tables import expected_table, mounting_table, parameter_rows, plan_lines

SHOWN = 20


def show_plan(console: Console, plan: Plan, folder: Path) -> None:
    """Tables and sentences."""
    console.print(rich_table(mounting_table(plan, SHOWN)))
    if plan.goal != "halve":
        console.print(rich_table(expected_table(plan)))
    if plan.parameters:
        console.print(rich_table(parameter_rows(plan)))
    for line in plan_lines(plan):
        console.print(line, markup=False, highlight=False)
    console.print(f"files: {folder}", markup=False, highlight=False, soft_wrap=True)
