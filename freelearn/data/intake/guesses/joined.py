"""The guess at a file with several sheets and at designs that stand elsewhere, and as plain values."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from freelearn.common.errors import UserError
from freelearn.common.files import read_bytes
from freelearn.data.intake.guesses.guess import column_guess, guess_table
from freelearn.data.intake.guesses.guessed import ColumnGuess, Guess, with_nan
from freelearn.data.intake.guesses.meanings import MEANINGS, OUTER_DIAMETER
from freelearn.data.intake.guesses.side_by_side import of_folder, of_lengths, of_recordings, together
from freelearn.data.intake.readers.cells import POINTS, NoTable
from freelearn.data.intake.readers.raw_files import is_folder, raw_table, sheet_grid, sheet_names
from freelearn.data.intake.readers.raw_table import Place, RawTable
from freelearn.data.intake.readers.told_elsewhere import Told, told_of
from freelearn.data.intake.recipes.recipe import DESIGN, Reading

# A measurement reads, or holds, so many quantities at least.
LEAST_READINGS = 2
# Nothing is read from a design: its diameter is the unloaded one, and its angle that of the fibers.
OF_DESIGNS = {"outer_diameter_mm": OUTER_DIAMETER, "twist_deg": "gamma_deg"}


@dataclass(frozen=True)
class DesignGuess:
    """file: "" for a sheet of the data's workbook. sample: the column of the data that names the actuators. columns:
    of the table → the column of the designs and its factor. unused: columns of the designs that are none of these."""

    file: str
    sheet: str
    by: str
    sample: str
    words: tuple[str, ...]
    columns: dict[str, tuple[ColumnGuess, float]]
    unused: tuple[str, ...] = ()


def guess_file(path: Path, design: Path | None = None) -> tuple[Guess, DesignGuess | None]:
    """The guess at a file, of its sheets the one that holds readings; and the designs that are joined with it. design:
    their file, where they have one. Raises UserError."""
    return guess_and_table(path, design)[:2]


def guess_and_table(
    path: Path, design: Path | None = None, name: str = "", wanted: str = "", by_time: bool = True
) -> tuple[Guess, DesignGuess | None, RawTable]:
    """The same with the table that the guess is about. name: what the file is called, if not as its path ends. wanted:
    the sheet, where somebody has said which. by_time: whether sheets, structures and arrays of several lengths that
    have a time each may be laid side by side. Raises UserError."""
    if is_folder(path):
        found, raw = of_folder(path)
        return found, None, raw
    content, name = read_bytes(path), name or path.name
    names = sheet_names(content, name)
    laid = of_lengths(content, name) if by_time and not wanted else None
    if laid is not None:
        found, raw = laid
        others: list[_Sheet] = []
    elif len(names) < 2:
        raw = raw_table(content, name)
        found = guess_table(raw)
        others = []
    else:
        tables, unread = _sheets(content, name, tuple(names))
        placed = [(Place("", one.name), one.table, one.found) for one in tables]
        if by_time and not wanted:
            laid = of_recordings(name, [(place, table) for place, table, _ in placed]) or together(name, placed)
        readings = {one.name: _readings(one.found) for one in tables}
        sheet = wanted if wanted in readings else max(readings, key=lambda one: readings[one])
        (chosen,) = (one for one in tables if one.name == sheet)
        found, raw = laid or (chosen.found, chosen.table)
        read = [place.sheet for recording in found.recordings for place in recording]
        read = read or [piece.place.sheet for piece in raw.pieces] or [sheet]
        others = [one for one in tables if one.name not in read]
        alike = [one for one in readings if readings[one][0] == readings[sheet][0] >= LEAST_READINGS]
        # Of recordings each may be meant alone.
        alike = [] if laid and not found.recordings else alike
        which = "sheets" if content.startswith(b"PK") else "parts"
        were = f"{', '.join(map(repr, read))} {'were' if read[1:] else 'was'} read"
        note = f"{name} has the {which} {', '.join(map(repr, names))}; {were}."
        if unread and _readings(found)[0] < LEAST_READINGS:
            # The readings may stand where nothing could be read.
            raise unread[0]
        about = {told.name: told for told in [*_told(content, name, names, read), *found.about]}
        notes = (note, *map(str, unread), *found.notes)
        sheets = tuple(alike) if alike[1:] else ()
        found = replace(found, sheet="" if laid else sheet, sheets=sheets, notes=notes, about=tuple(about.values()))
    if design is not None:
        joined = _joined(found, raw, raw_table(read_bytes(design), design.name), design.name, "")
        if joined is None:
            raise UserError(
                f"{design} names no actuators as {name} does: it needs a column with the same words as one there, "
                "and columns of the design with their units."
            )
    else:
        made = (_joined(found, raw, one.table, "", one.name) for one in others)
        joined = next((one for one in made if one is not None), None)
    return found, joined, raw


def _told(content: bytes, name: str, sheets: Sequence[str], read: Sequence[str]) -> list[Told]:
    """What other sheets than those that were read say of the actuator, in rows of names and numbers."""
    told = []
    for other in (one for one in sheets if one not in read):
        with suppress(UserError):
            told += told_of(sheet_grid(content, name, other).rows, POINTS, f"sheet {other!r}")
    return told


@dataclass(frozen=True)
class _Sheet:
    """One that holds a table, and the guess at it."""

    name: str
    table: RawTable
    found: Guess


@lru_cache(maxsize=1)
def _sheets(content: bytes, name: str, sheets: tuple[str, ...]) -> tuple[list[_Sheet], list[UserError]]:
    """The sheets that hold tables, and why others cannot be read; read once for all that is asked of one file. Raises
    UserError where none can."""
    tables, unread = [], []
    for sheet in sheets:
        try:
            table = raw_table(content, name, Reading(sheet=sheet))
            tables.append(_Sheet(sheet, table, guess_table(table)))
        except NoTable:
            pass
        except UserError as problem:
            unread.append(problem)
    if not tables:
        raise (
            unread[0] if unread else NoTable(f"{name} holds no table in any of its sheets: it needs a header and rows.")
        )
    return tables, unread


def _readings(found: Guess) -> tuple[int, int]:
    """How much of a measurement a sheet seems to hold."""
    quantities = {"force_n", "moment_nmm", "pressure_kpa", "elongation_mm", "twist_deg"}
    return len({c.quantity for c in found.columns if c.chosen} & quantities), found.rows


def _joined(found: Guess, raw: RawTable, designs: RawTable, file: str, sheet: str) -> DesignGuess | None:
    """The designs, if a column of theirs names each actuator of a column of the data once, and others are designs."""
    columns: dict[str, tuple[ColumnGuess, float]] = {}
    # Each by itself: what differs from row to row is a design here.
    guesses = [column_guess(designs, name) for name in designs.columns]
    # What says its name comes before what may be meant.
    for column in sorted(guesses, key=lambda c: c.quantity in OF_DESIGNS):
        meaning = MEANINGS.get(OF_DESIGNS.get(column.quantity or "", column.quantity or ""))
        if meaning is not None and meaning.column in DESIGN and meaning.column not in columns:
            columns[meaning.column] = (column, float(dict(meaning.keys).get("scale", 1.0)))
    if not columns:
        return None
    likely = sorted(raw.columns, key=lambda name: (found.of("sample") or found.columns[0]).name != name)
    for by in designs.columns:
        words = [word for word in designs.text(by) if word]
        for name in likely:
            there = set(raw.text(name)) - {""}
            if len(set(words)) == len(words) and there and there <= set(words) and by not in _used(columns):
                unused = tuple(c.name for c in guesses if c.name not in {by, *_used(columns)})
                return DesignGuess(file, sheet, by, name, tuple(words), columns, unused)
    return None


def _used(columns: dict[str, tuple[ColumnGuess, float]]) -> set[str]:
    return {column.name for column, _ in columns.values()}


# A guess as plain values, for a page that shows it.


@dataclass(frozen=True)
class Guessed:
    """A guess with the designs that are joined with it."""

    found: Guess
    joined: DesignGuess | None = None

    def plain(self) -> dict[str, Any]:
        """For JSON, which has no NaN."""
        plain: dict[str, Any] = json.loads(_adapter().dump_json(self))
        return plain

    @classmethod
    def from_plain(cls, content: dict[str, Any]) -> Guessed:
        """The same again. Raises ValueError where it is none."""
        return _adapter().validate_python(with_nan(content))


@lru_cache(maxsize=1)
def _adapter() -> TypeAdapter[Guessed]:
    return TypeAdapter(Guessed)
