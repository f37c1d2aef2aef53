"""What the terminal shows of a search, of the look before it and of the referee after it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from freelearn.common.display import DisplayTable
from freelearn.common.formats import sentence
from freelearn.data.table.unit_suspicions import units_apart
from freelearn.discovery.checks.table_check import TableCheck
from freelearn.discovery.fits.step import Step
from freelearn.records.claims import (
    REFEREE,
    RefereedRun,
    check_lines,
    checks_table,
    models_table,
    passed_beyond,
    shares_table,
)
from freelearn.records.discovery import Discovery
from freelearn.report.tables.discovery_tables import (
    error_line,
    failure_lines,
    final_parameters,
    next_state_lines,
    note_lines,
    remainder_lines,
    screen_lines,
    step_row,
    suspect_lines,
    suspect_overview,
    table_check_lines,
    written_lines,
)
from freelearn.report.tables.ranking_tables import HEADINGS, ranking_numbers, ranking_table
from freelearn.report.terminal.printed_tables import add_row, empty_table, print_words, rich_table, show_files


def show_checks(console: Console, checks: Sequence[TableCheck], overruled: bool) -> None:
    """What failed, and what to do about it; nothing where nothing did."""
    for line in table_check_lines(checks, overruled):
        print_words(console, f"! {line}")


def show_refereed(console: Console, done: RefereedRun) -> None:
    """The table of checks, sentences of those that did not pass, and what searches of simulated tables said."""
    checks = [check.plain() for check in done.checks]
    table = checks_table(checks, says=False)
    if table is not None:
        console.print(rich_table(table))
    for line in check_lines(checks):
        print_words(console, f"  ✗ {line}")
    print_words(console, done.stands())
    for line in done.told:
        print_words(console, line)
    print_words(console, f"file: {done.folder / REFEREE}")


# The discovery as it happens: a table whose error falls towards the noise floor, then the verdict.

SHOWN = 5
MOST_FAILURES = 3
MOST_SUSPECTS = 8


class DiscoveryView:
    """Prints a discovery. As a context manager it keeps the table of steps up to date while the search runs. said: what
    a look at the table has told already."""

    def __init__(self, console: Console, what: str, simulated: bool, said: Sequence[str] = ()) -> None:
        self.console = console
        self.said = said
        source = "simulated data" if simulated else "measured data"
        columns = DisplayTable.from_rows(["step"], HEADINGS, [], last=["remaining misfit"]).columns
        self.table = empty_table(columns, f"{what} ({source})")
        self.live = Live(self.table, console=console, auto_refresh=False)
        # What is done meanwhile is for somebody who waits, not for a log.
        self.waited_for = console.is_terminal

    def __enter__(self) -> DiscoveryView:
        """Shows the table, still without rows."""
        self.live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leaves the table as it is."""
        self.live.update(self.table)
        self.live.stop()

    def step(self, step: Step, text: str) -> None:
        """Adds a step. text: what it added to the model."""
        add_row(self.table, step_row(step, text))
        self.live.refresh()

    def doing(self, words: str, done: int, total: int) -> None:
        """Says below the table what is done now, and about how much of the search is."""
        if self.waited_for:
            self.live.update(Group(self.table, Text(f"{done / total:4.0%}  {words}", style="dim")), refresh=True)

    def answer(self, discovery: Discovery) -> None:
        """Says what came out."""
        units = units_apart(discovery.notes)[0]
        self._say([unit for unit in units if sentence(unit) not in self.said], before="\n! ")
        self._say(["Where the model failed at first:"], before="\n")
        self._say([*failure_lines(discovery, MOST_FAILURES), *screen_lines(discovery)], before="  · ")
        ranking = ranking_numbers(discovery.content["candidates"])
        if len(ranking):
            self.console.print(rich_table(ranking_table(ranking, SHOWN)))
        if discovery.findings.final.effects:
            self.console.print(rich_table(final_parameters(discovery)))
        self._say([discovery.content["says"], error_line(discovery)])
        self._claim(discovery)
        self._say(written_lines(discovery), before="  ")
        self._say(next_state_lines(discovery.proposed, SHOWN), before="  → ")
        self._say(remainder_lines(discovery), before="  ")
        if discovery.suspects:
            self.console.print(rich_table(suspect_overview(discovery, MOST_SUSPECTS)))
            self._say(suspect_lines(discovery), before="? ")
        said = [sentence(unit) for unit in units]
        self._say([line for line in note_lines(discovery) if line not in said], before="! ")

    def end(self, folder: Path) -> None:
        """Says where the files are."""
        show_files(self.console, folder, report="report.html")

    def _claim(self, discovery: Discovery) -> None:
        """Whether it stands, what else would fit as well, and how probable each effect is."""
        content = discovery.content
        # The sentences of all checks are long: here only those that did not pass.
        checks = checks_table(content["referee"], says=False, asked=content["refereed"])
        tables = checks, models_table(content["models"])
        for table in (*tables, shares_table(content["shares"])):
            if table:
                self.console.print(rich_table(table))
        self._say(check_lines(content["referee"]), before="  ✗ ")
        self._say(passed_beyond(content["referee"]), before="  · ")

    def _say(self, lines: list[str], before: str = "") -> None:
        for line in lines:
            print_words(self.console, f"{before}{line}")
