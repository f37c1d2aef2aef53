"""Whether channels that stand in sheets, structures or files of their own, each with a time, are those of one test."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from freelearn.common.errors import UserError
from freelearn.common.files import read_bytes
from freelearn.data.intake.guesses.clocks import CHANNELS
from freelearn.data.intake.guesses.guess import guess_table
from freelearn.data.intake.guesses.guessed import Guess
from freelearn.data.intake.readers.matlab_table import lengths_of
from freelearn.data.intake.readers.raw_files import is_matlab, raw_table, sheet_names
from freelearn.data.intake.readers.raw_table import Place, RawTable
from freelearn.data.intake.readers.side_by_side import laid_side_by_side

# More files than this are no channels of one test.
MOST_FILES = 12
Tables = Sequence[tuple[Place, RawTable, Guess]]


def together(name: str, tables: Tables) -> tuple[Guess, RawTable] | None:
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


def of_lengths(content: bytes, name: str) -> tuple[Guess, RawTable] | None:
    """The guess at arrays of several lengths in a MATLAB or HDF5 file; None where there are none."""
    readings = lengths_of(content, name) if is_matlab(content, name) else []
    tables = []
    for reading in readings:
        with suppress(UserError):
            table = raw_table(content, name, reading)
            tables.append((Place("", reading.sheet or "", reading.variables), table, guess_table(table)))
    return together(name, tables)


def of_files(paths: Sequence[Path]) -> tuple[Guess, RawTable] | None:
    """The guess at files that are channels of one test, each with a time of its own; None where they are not."""
    if not 1 < len(paths) <= MOST_FILES or len({path.parent for path in paths}) > 1:
        return None
    tables: list[tuple[Place, RawTable, Guess]] = []
    seen: set[str] = set()
    for path in paths:
        try:
            content = read_bytes(path)
            if len(sheet_names(content, path.name)) > 1:
                return None
            table = raw_table(content, path.name)
            found = guess_table(table)
        except UserError:
            continue
        channels = _channels(found)
        if channels & seen:
            return None
        seen |= channels
        tables.append((Place(path.name), table, found))
    return together(", ".join(place.file for place, _, _ in tables), tables)
