"""A display table in the terminal."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from freelearn.results.tables import Column, DisplayTable


def rich_table(table: DisplayTable) -> Table:
    """The table for rich's console. Numbers are never cut short; words take a second line where they have to."""
    shown = empty_table(table.columns, table.title, table.caption)
    for row in table.rows:
        add_row(shown, row)
    return shown


def empty_table(columns: tuple[Column, ...], title: str = "", caption: str = "") -> Table:
    """Headings without rows, for a table that grows."""
    # Text, because in plain strings rich reads square brackets as markup.
    shown = Table(
        title=Text(title) if title else None,
        caption=Text(caption) if caption else None,
        title_justify="left",
        caption_justify="left",
    )
    for column in columns:
        shown.add_column(
            Text(column.heading),
            justify="left" if column.words else "right",
            overflow="fold",
            no_wrap=not column.words,
        )
    return shown


def add_row(shown: Table, row: tuple[str, ...] | list[str]) -> None:
    """Adds finished cells."""
    shown.add_row(*(Text(cell) for cell in row))
