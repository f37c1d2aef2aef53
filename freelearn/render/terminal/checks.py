"""The look at a table before a search, in the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from freelearn.inference.checks.check import TableCheck
from freelearn.results.check_tables import check_lines


def show_checks(console: Console, checks: Sequence[TableCheck], overruled: bool) -> None:
    """What failed, and what to do about it; nothing where nothing did."""
    for line in check_lines(checks, overruled):
        console.print(f"! {line}", markup=False, highlight=False)
