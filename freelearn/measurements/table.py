"""Reading a measurement table (CSV), with every fault of the file in one report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.faults import TableError
from freelearn.measurements.plausibility import unit_warnings
from freelearn.measurements.records import header_faults, numbers_of, odd_rows, read_records
from freelearn.measurements.schema import INTEGERS, OPTIONAL, REQUIRED, find_faults
from freelearn.measurements.usable import LEFT_OUT, usable_rows

SEPARATORS = {";": "semicolons", "\t": "tabs"}


@dataclass(frozen=True)
class TableFile:
    """A checked measurement table.

    table: the file's columns and N rows in their order: sample, step, buckled and left_out (blank: 0) as int64, the
    contract's other columns as float64 in the units that their names say, further columns as the text in the file.
    lines: the line in the file at which each row begins, (N,) int64. warnings: about units that look wrong.
    """

    table: pd.DataFrame
    lines: np.ndarray
    warnings: list[str]


def read_table(path: str | Path) -> TableFile:
    """Reads and checks a measurement table. Blank lines are skipped.

    Raises TableError with all faults of the rows and columns, and UserError where the file as a whole is not such a
    table. Nothing is executed or written.
    """
    records = read_records(path)
    header = [name.strip() for name in records.header]
    _refuse_other_formats(path, header)
    if not records.rows:
        raise UserError(f"{path} holds no rows: there is only a header. Add the measurements below it.")

    faults = [*header_faults(header, records.header_line), *odd_rows(records)]
    odd = {fault.line for fault in faults}
    lines = [line for line in records.lines if line not in odd]
    rows = (row for line, row in zip(records.lines, records.rows, strict=True) if line not in odd)
    columns = zip(*rows, strict=True) if lines else [()] * len(header)
    text: dict[str, Sequence[str]] = {}
    for name, column in zip(header, columns, strict=True):
        text.setdefault(name, column)

    known = [name for name in (*REQUIRED, *OPTIONAL) if name in text]
    columns_read = {name: numbers_of(_unmarked(text[name]) if name == LEFT_OUT else text[name]) for name in known}
    numbers = pd.DataFrame(columns_read, index=pd.Index(lines, dtype=np.int64))
    faults += find_faults(numbers, text, records.header_line)
    if faults:
        raise TableError(path, sorted(faults, key=lambda fault: fault.line))

    numbers = numbers.astype({name: np.int64 for name in INTEGERS if name in numbers}).reset_index(drop=True)
    if not usable_rows(numbers).any():
        marked = "buckled" if numbers["buckled"].all() else "buckled or left out"
        raise UserError(f"Every row of {path} is marked as {marked}, so none can be fitted or scored.")
    frame = pd.DataFrame({name: numbers[name] if name in numbers else list(text[name]) for name in header})
    return TableFile(frame, np.array(lines, dtype=np.int64), [*_near_optional(header), *unit_warnings(frame)])


def _unmarked(cells: Sequence[str]) -> list[str]:
    """The cells of a column of marks; one that is blank marks nothing."""
    return [cell if cell.strip() else "0" for cell in cells]


def _refuse_other_formats(path: str | Path, header: list[str]) -> None:
    required = set(REQUIRED)
    for separator, name in SEPARATORS.items():
        parts = {part.strip() for part in separator.join(header).split(separator)}
        if len(parts & required) > len(required.intersection(header)):
            raise UserError(f"{path} separates its columns by {name}: save it with commas and decimal points.")
    if not np.isnan(numbers_of(header)).any():
        raise UserError(f"{path} has no header: its first line must name the columns {', '.join(REQUIRED)}.")


def _near_optional(header: list[str]) -> list[str]:
    """Warnings about columns whose names nearly are those of optional ones, which are therefore not used."""
    warnings = []
    for name in OPTIONAL:
        if name not in header:
            further = [column for column in header if column not in (*REQUIRED, *OPTIONAL)]
            for near in get_close_matches(name, further, n=1, cutoff=0.75):
                warnings.append(f"Column {near!r} is kept but not used: rename it to {name} if that is meant.")
    return warnings
