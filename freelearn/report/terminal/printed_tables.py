"""A display table in the terminal, and lines that stand there as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill

from rich.box import SIMPLE_HEAD
from rich.console import Console, ConsoleOptions, JustifyMethod, RenderResult
from rich.table import Table
from rich.text import Text

from freelearn.common.display import Column, DisplayTable

# Room for a number of which nothing is known yet, in a table that grows, and for a name.
NUMBER_WIDTH, NAME_WIDTH = 7, 21
# Longer names are folded, before their last part where they have parts.
WIDEST_NAME = 28
# As wide as no terminal is: on it every column has its room.
ENDLESS = 10_000


@dataclass(frozen=True)
class FittedTable:
    """A table that knows how wide the terminal is: rich would cut what has no room, headings and numbers. Here the last
    columns stand in a table of their own below, beside the names once more."""

    table: DisplayTable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The table, or its parts."""
        whole, endless = _table(self.table), options.update(max_width=ENDLESS)
        if console.measure(whole, options=endless).minimum <= options.max_width or len(self.table.columns) < 3:
            yield whole
            return
        first, count = int(self.table.columns[0].words), len(self.table.columns)
        # As many of the columns as fit, one at least.
        fits = [
            n
            for n in range(first + 1, count)
            if console.measure(_table(_part(self.table, 0, n, first)), options=endless).minimum <= options.max_width
        ]
        cut = fits[-1] if fits else first + 1
        yield _table(replace(_part(self.table, 0, cut, 0), caption=""))
        yield FittedTable(replace(_part(self.table, cut, count, first), title=""))


def _part(table: DisplayTable, begin: int, end: int, first: int) -> DisplayTable:
    """Some of the columns, and the first ones before them, once."""
    chosen = [*range(min(first, begin)), *range(begin, end)]
    rows = tuple(tuple(row[i] for i in chosen) for row in table.rows)
    return replace(table, columns=tuple(table.columns[i] for i in chosen), rows=rows)


def rich_table(table: DisplayTable) -> FittedTable:
    """The table for rich's console. Numbers and names are never cut short: sentences and headings take more lines
    where they have to, and columns that have no room stand below."""
    return FittedTable(table)


def _table(table: DisplayTable) -> Table:
    cells = zip(*table.rows, strict=True) if table.rows else ((),) * len(table.columns)
    widths = [
        max((len(part) for cell in column for part in (_folded(cell).split() if of.words else [cell])), default=0)
        for of, column in zip(table.columns, cells, strict=True)
    ]
    shown = empty_table(table.columns, table.title, table.caption, widths)
    for row in table.rows:
        add_row(shown, row)
    return shown


def empty_table(
    columns: Sequence[Column], title: str = "", caption: str = "", widths: Sequence[int] | None = None
) -> Table:
    """Headings without rows, for a table that grows. widths: of each column's widest word or number, where they are
    known."""
    # Text, because in plain strings rich reads square brackets as markup.
    shown = Table(
        title=Text(title) if title else None,
        caption=Text(caption) if caption else None,
        title_justify="left",
        caption_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    unknown = [NAME_WIDTH if first else NUMBER_WIDTH for first in (True, *[False] * (len(columns) - 1))]
    for column, width in zip(columns, widths or unknown, strict=True):
        # A name that is longer than any line is folded; of a number's column only the heading is.
        justify: JustifyMethod = "left" if column.words else "right"
        width = min(width, WIDEST_NAME)
        heading = fill(column.heading, max(width, NUMBER_WIDTH), break_long_words=False, break_on_hyphens=False)
        shown.add_column(Text(heading), justify=justify, overflow="fold", min_width=width)
    return shown


def add_row(shown: Table, row: Sequence[str]) -> None:
    """Adds finished cells."""
    shown.add_row(*(Text(_folded(cell)) for cell in row))


def _folded(cell: str) -> str:
    """The cell, a long name of two parts on two lines."""
    name = len(cell) > WIDEST_NAME and " " not in cell and "." in cell
    return "\n.".join(cell.rsplit(".", 1)) if name else cell


def print_words(console: Console, text: str) -> None:
    """A sentence as it is, nothing of it taken for rich's marks; long ones go on in the next line."""
    console.print(text, markup=False, highlight=False)


def print_line(console: Console, text: str) -> None:
    """A line as it is: a wrapped or colored path, or command, cannot be copied."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def show_files(console: Console, folder: Path, **opened: str) -> None:
    """Where the files are, and those to open first, by what they are."""
    paths = {"files": folder} | {what: folder / name for what, name in opened.items() if (folder / name).is_file()}
    for what, path in paths.items():
        print_line(console, f"{what}: {path}")
