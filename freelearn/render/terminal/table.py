"""A display table in the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from rich.box import SIMPLE_HEAD
from rich.console import JustifyMethod
from rich.table import Table
from rich.text import Text

from freelearn.results.tables import Column, DisplayTable

# Room for a number of which nothing is known yet, in a table that grows, and for a name.
NUMBER_WIDTH, NAME_WIDTH = 7, 21
# Longer names are folded, before their last part where they have parts.
WIDEST_NAME = 28


def rich_table(table: DisplayTable) -> Table:
    """The table for rich's console. Numbers and names are never cut short: sentences and headings take more lines
    where they have to."""
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
