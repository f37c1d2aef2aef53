"""Tables of several clocks, from sheets, structures or files of their own, laid side by side as one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from freelearn.data.intake.readers.cells import POINTS, Style
from freelearn.data.intake.readers.raw_table import Piece, Place, RawTable


def laid_side_by_side(name: str, tables: Sequence[tuple[Place, RawTable]]) -> RawTable:
    """One table of the columns of all, blank below the shorter ones; a name that stands in several is written with
    where it stands. name: of all of them."""
    often = Counter(column for _, table in tables for column in table.columns)
    pieces = []
    for place, table in tables:
        own = _with_points(table)
        names = {f"{place.called}: {column}" if often[column] > 1 else column: column for column in own.columns}
        pieces.append(Piece(place, own, names))
    length = max(map(len, (piece.table for piece in pieces)))
    columns = {
        wide: [*piece.table.columns[column], *[""] * (length - len(piece.table))]
        for piece in pieces
        for wide, column in piece.names.items()
    }
    units = {
        wide: piece.table.units[column]
        for piece in pieces
        for wide, column in piece.names.items()
        if column in piece.table.units
    }
    longest = max((piece.table for piece in pieces), key=len)
    tabled = [piece.table for piece in pieces]
    texts = None if any(t.texts is None for t in tabled) else frozenset().union(*(t.texts or () for t in tabled))
    return RawTable(
        name, columns, longest.lines, units=units, notes=tuple(note for t in tabled for note in t.notes),
        about=tuple(told for t in tabled for told in t.about), texts=texts, pieces=tuple(pieces),
    )  # fmt: skip


def _with_points(table: RawTable) -> RawTable:
    """The table with its numbers as they are written with decimal points; other cells stay as they are."""
    if table.style == POINTS:
        return table
    columns = {name: [_number(cell, table.style) for cell in cells] for name, cells in table.columns.items()}
    return replace(table, columns=columns, style=POINTS)


def _number(cell: str, style: Style) -> str:
    value = style.number(cell)
    return cell if value is None or not np.isfinite(value) else repr(value)
