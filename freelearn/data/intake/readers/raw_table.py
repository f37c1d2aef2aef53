"""A laboratory's table as it was read: text by column, the line of each row, and what the reader took for granted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches

import numpy as np

from freelearn.common.errors import UserError
from freelearn.data.intake.readers.cells import POINTS, Style, numbers
from freelearn.data.intake.readers.stamps import seconds
from freelearn.data.intake.readers.told_elsewhere import Told

MOST_SHOWN = 3


@dataclass(frozen=True)
class Place:
    """Where columns stand. file: beside the data, "" for the data's own. sheet: of a workbook; a structure. variables:
    of a MATLAB file, () for all. names: that their columns are given, () where they have names."""

    file: str = ""
    sheet: str = ""
    variables: tuple[str, ...] = ()
    names: tuple[str, ...] = ()

    @property
    def called(self) -> str:
        """Its name, "" for the data's own."""
        return self.file or self.sheet or ", ".join(self.variables)


@dataclass(frozen=True)
class Piece:
    """A table that was laid beside others. names: of its columns in the wide one → its own."""

    place: Place
    table: RawTable
    names: Mapping[str, str]


@dataclass(frozen=True)
class RawTable:
    """columns: name → N cells; of columns with one name the second is called "name [2]". units: of a row of units.
    lines: of each row in the file (of a matrix: its number). notes: what the reader passed over or assumed. about: what
    the file says of the actuator outside the table. head: the lines above it. texts: where cells are typed, those that
    were text; None in a file of text, where all were. pieces: of which it was laid together, () for one that was read
    as it is. firsts: of matrices without headings the first columns that rise evenly, as a time does."""

    name: str
    columns: dict[str, list[str]]
    lines: list[int]
    style: Style = POINTS
    units: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    about: tuple[Told, ...] = ()
    head: tuple[tuple[int, list[str]], ...] = ()
    texts: frozenset[str] | None = None
    pieces: tuple[Piece, ...] = ()
    firsts: frozenset[str] = frozenset()

    def __len__(self) -> int:
        return len(self.lines)

    def known(self, column: str) -> str:
        """The column's own name, perhaps written with other spaces or case. Raises UserError where there is none."""
        if column in self.columns:
            return column
        same = [name for name in self.columns if _bare(name) == _bare(column)]
        if len(same) == 1:
            return same[0]
        longer = [name for name in self.columns if _bare(name).startswith(_bare(column)) and column]
        near = longer[:1] or get_close_matches(column, self.columns, n=1, cutoff=0.5)
        hint = f": did you mean {near[0]!r}?" if near else f": it has {', '.join(map(repr, self.columns))}."
        raise UserError(f"{self.name} has no column {column!r}{hint}")

    def text(self, column: str) -> list[str]:
        """The column's cells without spaces around them. Raises UserError."""
        return [cell.strip() for cell in self.columns[self.known(column)]]

    def numbers(self, column: str, blanks: Sequence[str] = ()) -> np.ndarray:
        """The column as float64, NaN where blank. blanks: further words for it. Raises UserError where a cell is
        neither blank nor a number."""
        name = self.known(column)
        cells = self.columns[name]
        read = numbers(["" if cell.strip() in blanks else cell for cell in cells] if blanks else cells, self.style)
        if read.bad:
            rows = list(read.bad)
            shown = "; ".join(
                f"line {self.lines[r]} {self.columns[name][r].strip()[:30]!r} {read.bad[r]}" for r in rows[:MOST_SHOWN]
            )
            more = f" (and {len(rows) - MOST_SHOWN} more such cells)" if len(rows) > MOST_SHOWN else ""
            raise UserError(f"{self.name}, column {name!r}: {shown}{more}.")
        return read.values

    def seconds(self, column: str, blanks: Sequence[str] = ()) -> np.ndarray:
        """A column of dates as seconds since 1970, of times of day since midnight; NaN where blank. blanks: further
        words for it. Raises UserError where a cell is neither."""
        name = self.known(column)
        values, bad = seconds(self.columns[name], blanks)
        if bad:
            shown = repr(self.columns[name][bad[0]].strip()[:30])
            raise UserError(
                f"{self.name}, column {name!r}: line {self.lines[bad[0]]} {shown} is "
                "no date with a time of day such as 2026-02-25 10:00:00.5: correct it, or leave its row out with drop:."
            )
        return values

    def maybe_numbers(self, column: str) -> np.ndarray | None:
        """The same, or None where the column holds text or nothing."""
        read = numbers(self.columns[column], self.style)
        return None if read.bad or np.isnan(read.values).all() else read.values

    def most_numbers(self, column: str) -> np.ndarray | None:
        """The numbers among the cells, NaN where one is blank or none; None where there are none."""
        values = numbers(self.columns[column], self.style).values
        return None if np.isnan(values).all() else values

    def words(self, column: str) -> dict[str, int]:
        """Words such as #DIV/0! that stand for missing numbers in the column, and how often."""
        return numbers(self.columns[self.known(column)], self.style).words

    def rows(self, chosen: Sequence[int] | np.ndarray) -> RawTable:
        """These rows, in this order."""
        places = [int(row) for row in chosen]
        columns = {name: [cells[row] for row in places] for name, cells in self.columns.items()}
        return replace(self, columns=columns, lines=[self.lines[row] for row in places])


def unique_names(header: Sequence[str]) -> list[str]:
    """Names of columns, each once; nameless ones are called by their place.

    >>> unique_names(["F", "F", ""])
    ['F', 'F [2]', 'column 3']
    """
    names: dict[str, None] = {}
    counts: dict[str, int] = {}
    for place, title in enumerate(header, start=1):
        name = " ".join(title.split()) or f"column {place}"
        count, chosen = counts.get(name, 1), name
        while chosen in names:
            count += 1
            chosen = f"{name} [{count}]"
        names[chosen], counts[name] = None, count
    return list(names)


def _bare(name: str) -> str:
    return "".join(name.split()).lower()
