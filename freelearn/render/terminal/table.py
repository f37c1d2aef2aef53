"""A display table in the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from freelearn.results.tables import Column, DisplayTable

# Room for a number of which nothing is known yet, in a table that grows.
NUMBER_WIDTH = 8


def rich_table(table: DisplayTable) -> Table:
    """The table for rich's console. Numbers are never cut short: words and headings take more lines where they have
    to."""
    cells = zip(*table.rows, strict=True) if table.rows else ((),) * len(table.columns)
    widths = [max(map(len, column), default=0) for column in cells]
    shown = empty_table(table.columns, table.title, table.caption, widths)
    for row in table.rows:
        add_row(shown, row)
    return shown


def empty_table(
    columns: Sequence[Column], title: str = "", caption: str = "", widths: Sequence[int] | None = None
) -> Table:
    """Headings without rows, for a table that grows. widths: of each column's widest cell, where they are known."""
    # Text, because in plain strings rich reads square brackets as markup.
    shown = Table(
        title=Text(title) if title else None,
        caption=Text(caption) if caption else None,
        title_justify="left",
        caption_justify="left",
    )
    for column, width in zip(columns, widths or [NUMBER_WIDTH] * len(columns), strict=True):
        # Words may be folded anywhere; of a number's column only the heading may.
        shown.add_column(
            Text(column.heading),
            justify="left" if column.words else "right",
            overflow="fold",
            min_width=None if column.words else width,
        )
    return shown


def add_row(shown: Table, row: Sequence[str]) -> None:
    """Adds finished cells."""
    shown.add_row(*(Text(cell) for cell in row))
