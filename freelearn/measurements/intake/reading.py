"""How a file is to be read, where the guess would be wrong: the section `read` of a recipe."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Reading:
    """All of it may be left out. sheet: of a workbook. variables: of a MATLAB file, columns or one matrix. encoding and
    separator: of text. decimal, thousands: how numbers are written. header: its line in the file. names: of the columns
    of a file without a header. units_row: whether the row below the header says units."""

    sheet: str | None = None
    variables: tuple[str, ...] = ()
    encoding: str | None = None
    separator: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    header: int | None = None
    names: tuple[str, ...] = ()
    units_row: bool | None = None
