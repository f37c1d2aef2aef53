"""What the referee says of a run, in the terminal."""

from __future__ import annotations

from rich.console import Console

from freelearn.render.terminal.table import rich_table
from freelearn.results.claim_tables import check_lines, checks_table
from freelearn.results.referee_file import REFEREE
from freelearn.results.refereed_run import RefereedRun


def show_refereed(console: Console, done: RefereedRun) -> None:
    """The table of checks, sentences of those that did not pass, and what searches of simulated tables said."""
    checks = [check.plain() for check in done.checks]
    table = checks_table(checks, says=False)
    if table is not None:
        console.print(rich_table(table))
    for line in check_lines(checks):
        console.print(f"  ✗ {line}", markup=False, highlight=False)
    if done.claimed:
        stands = "stands" if done.claimed == done.verdict else f"does not stand: {done.verdict}"
        console.print(f"What was claimed ({done.claimed}) {stands}.", highlight=False)
    for line in done.told:
        console.print(line, markup=False, highlight=False)
    console.print(f"file: {done.folder / REFEREE}", markup=False, highlight=False)
