"""Whether channels that stand in sheets, structures or files of their own, each with a time, are those of one
test: they are then laid side by side as one table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from freelearn.common.errors import UserError
from freelearn.common.files import read_bytes
from freelearn.data.intake.guesses.clocks import CHANNELS
from freelearn.data.intake.guesses.guess import guess_table
from freelearn.data.intake.guesses.guessed import Guess
from freelearn.data.intake.guesses.recordings_found import form_of, label_of, recordings_of
from freelearn.data.intake.readers.cells import POINTS, Style
from freelearn.data.intake.readers.matlab_table import lengths_of, matrices_of
from freelearn.data.intake.readers.raw_files import is_matlab, raw_table, sheet_names, table_files
from freelearn.data.intake.readers.raw_table import Piece, Place, RawTable
from freelearn.data.intake.recipes.recipe import Reading

# More files than this are no recordings, more of several forms no channels of one test.
MOST_FILES, MOST_CHANNELS = 500, 12
# A recording has so many columns of numbers, and so many are named in a note.
LEAST_COLUMNS, MOST_NAMED = 2, 4
Tables = Sequence[tuple[Place, RawTable, Guess]]
Laid = tuple[Guess, RawTable]


def together(name: str, tables: Tables) -> Laid | None:
    """The guess at tables that have a time each and share no quantity, and what they are side by side; None where they
    are no channels of one test."""
    clocked = [(place, table, channels) for place, table, found in tables if (channels := _channels(found))]
    every = [quantity for _, _, channels in clocked for quantity in channels]
    if len(clocked) < 2 or len(set(every)) < len(every):
        return None
    wide = laid_side_by_side(name, [(place, table) for place, table, _ in clocked])
    found = guess_table(wide)
    return (found, wide) if found.clocks else None


def _channels(found: Guess) -> set[str]:
    """The quantities that go by a clock of the table; none without a clock."""
    clocked = any(c.is_clock for c in found.columns)
    return {c.column for c in found.columns if c.chosen and c.column in CHANNELS} if clocked else set()


def of_recordings(name: str, tables: Sequence[tuple[Place, RawTable]]) -> Laid | None:
    """The guess at the first of several recordings of one form, with where the others stand; None where they are none.
    name: of all of them."""
    found = recordings_of([(place, form_of(table)) for place, table in tables])
    if not found:
        return None
    at = dict(tables)
    first = [(place, at[place], guess_table(at[place])) for place in found[0]]
    laid = (first[0][2], first[0][1]) if len(first) == 1 else together(name, first)
    if laid is None or sum(c.numeric for c in laid[0].columns) < LEAST_COLUMNS:
        return None
    called = ", ".join(map(label_of, found[:MOST_NAMED])) + (", …" if found[MOST_NAMED:] else "")
    used = {place for recording in found for place in recording}
    left = ", ".join(repr(place.called) for place, _ in tables if place not in used)
    note = f"{name} holds {len(found)} recordings of one form ({called}), of which the first is shown."
    notes = (note, *([f"{name}: of another form, and not used: {left}."] if left else []))
    guess = replace(laid[0], name=name, recordings=found, notes=(*notes, *laid[0].notes))
    return guess, laid[1]


def of_lengths(content: bytes, name: str) -> Laid | None:
    """The guess at matrices of a time and its channels, and at arrays of several lengths, in a MATLAB, HDF5 or NumPy
    file; None where there are none."""
    if not is_matlab(content, name):
        return None
    matrices = matrices_of(content, name)
    tables = []
    for key, (width, quantity) in matrices.items():
        if list(matrices.values()).count((width, quantity)) > 1:
            names = tuple(f"{quantity.rpartition('_')[0] or 'column'} {i}" for i in range(1, width + 1))
            table = raw_table(content, name, Reading(variables=(key,), names=names))
            tables.append((Place("", "", (key,), names), table))
    if laid := of_recordings(name, tables):
        return laid
    readings = lengths_of(content, name)
    items = []
    for reading in readings:
        with suppress(UserError):
            table = raw_table(content, name, reading)
            items.append((Place("", reading.sheet or "", reading.variables), table, guess_table(table)))
    return together(name, items)


def of_files(paths: Sequence[Path], folder: Path | None = None) -> Laid | None:
    """The guess at files that are channels of one test, each with a time of its own, or several recordings of one form;
    None where they are not. folder: that holds them, perhaps in folders of its own; without it that of the first."""
    folder = folder or (paths[0].parent if paths else Path())
    if not 1 < len(paths) <= MOST_FILES or not all(path.is_relative_to(folder) for path in paths):
        return None
    tables, unread = [], []
    for path in paths:
        name = path.relative_to(folder).as_posix()
        try:
            content = read_bytes(path)
            if len(sheet_names(content, name)) > 1:
                return None
            tables.append((Place(name), raw_table(content, name)))
        except UserError:
            unread.append(name)
    laid = of_recordings(folder.name, tables) or _channels_of(tables)
    if laid is None or not unread:
        return laid
    note = f"{folder.name}: no tables, and not used: {', '.join(map(repr, unread))}."
    return replace(laid[0], notes=(note, *laid[0].notes)), laid[1]


def of_folder(folder: Path) -> Laid:
    """The guess at a folder's files. Raises UserError where they do not belong together."""
    names = table_files(folder)
    if laid := of_files([folder / name for name in names], folder):
        return laid
    raise not_together(folder, names)


def not_together(folder: Path, names: Sequence[str]) -> UserError:
    """What to say of a folder whose files do not belong together."""
    return UserError(
        f"{folder}: its tables ({', '.join(names[:MOST_NAMED])}) are neither recordings of one form nor channels with "
        "a time each: name the files that belong together, or one of them."
    )


def _channels_of(tables: Sequence[tuple[Place, RawTable]]) -> Laid | None:
    """The guess at the channels of one test."""
    if len(tables) > MOST_CHANNELS:
        return None
    guesses = [(place, table, guess_table(table)) for place, table in tables]
    return together(", ".join(place.file for place, _ in tables), guesses)


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
