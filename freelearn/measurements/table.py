"""Reading a measurement table (CSV), with every fault of the file in one report."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.plausibility import unit_warnings
from freelearn.measurements.schema import INTEGERS, OPTIONAL, REQUIRED, Fault, find_faults

PRINTED_FAULTS = 20
PRINTED_CHARACTERS = 40
SEPARATORS = {";": "semicolons", "\t": "tabs"}


class TableError(UserError):
    """A table with faults. faults: all of them, in the order of the file; the message prints the first 20."""

    def __init__(self, path: str | Path, faults: Sequence[Fault]) -> None:
        self.faults = list(faults)
        count = "1 fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
        printed = [_printed(fault) for fault in self.faults[:PRINTED_FAULTS]]
        if len(self.faults) > PRINTED_FAULTS:
            printed.append(f"… and {len(self.faults) - PRINTED_FAULTS} more")
        super().__init__("\n  ".join([f"{path} has {count}:", *printed]))


def read_table(path: str | Path) -> tuple[pd.DataFrame, list[str]]:
    """Read and check a measurement table: its frame, and warnings about units that look wrong.

    The frame holds the file's columns and rows in their order: sample, step and buckled as int64, the contract's
    other columns as float64 in the units that their names say, further columns as the text in the file. Blank
    lines are skipped. Raises TableError with all faults of the rows and columns, and UserError where the file as
    a whole is not such a table. Nothing is executed or written.
    """
    records = _records(path, _text(path))
    header = [name.strip() for name in records.header]
    _refuse_other_formats(path, header)
    if not records.rows:
        raise UserError(f"{path} holds no rows: there is only a header. Add the measurements below it.")

    faults = [*_header_faults(header, records.header_line), *_odd_rows(records)]
    odd = {fault.line for fault in faults}
    lines = [line for line in records.lines if line not in odd]
    rows = (row for line, row in zip(records.lines, records.rows, strict=True) if line not in odd)
    columns = zip(*rows, strict=True) if lines else [()] * len(header)
    text: dict[str, Sequence[str]] = {}
    for name, column in zip(header, columns, strict=True):
        text.setdefault(name, column)

    known = [name for name in (*REQUIRED, *OPTIONAL) if name in text]
    numbers = pd.DataFrame({name: _numbers(text[name]) for name in known}, index=pd.Index(lines, dtype=np.int64))
    faults += find_faults(numbers, text, records.header_line)
    if faults:
        raise TableError(path, sorted(faults, key=lambda fault: fault.line))

    numbers = numbers.astype(dict.fromkeys(INTEGERS, np.int64)).reset_index(drop=True)
    if numbers["buckled"].all():
        raise UserError(f"Every row of {path} is marked as buckled, so none can be fitted or scored.")
    frame = pd.DataFrame({name: numbers[name] if name in numbers else list(text[name]) for name in header})
    return frame, [*_near_optional(header), *unit_warnings(frame)]


def _text(path: str | Path) -> str:
    """The file's text. Raises UserError, in one sentence, when there is none to read."""
    file = Path(path)
    try:
        if file.is_dir():
            raise UserError(f"{path} is a folder: name the CSV file in it.")
        if not file.exists():
            raise UserError(f"There is no file {path}{_near_files(file)}.")
        if not file.is_file():  # Reading a device or a pipe might never end.
            raise UserError(f"{path} is not a regular file: save the table as a CSV file first.")
        content = file.read_bytes()
    except PermissionError as error:
        raise UserError(f"{path} may not be read by this user: change its permissions.") from error
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}.") from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UserError(f"{path} is not UTF-8 text (line {line}): save it as CSV in UTF-8.") from error
    if "\0" in text:
        raise UserError(f"{path} is a binary file, not UTF-8 text: save the table as CSV in UTF-8.")
    if not text.strip():
        raise UserError(f"{path} is empty: it needs a header and rows.")
    return text


def _near_files(file: Path) -> str:
    """What to suggest for a missing file, from the names in its folder; the start of a clause, or nothing."""
    if not file.parent.is_dir():
        return f": its folder {file.parent} does not exist either"
    names = sorted(f.name for f in file.parent.iterdir() if f.is_file())
    near = get_close_matches(file.name, names, n=3) or [n for n in names if n.lower().endswith(".csv")][:5]
    return f": {file.parent} holds {', '.join(near)}" if near else f", nor any CSV file in {file.parent}"


@dataclass(frozen=True)
class _Records:
    """The fields of a CSV file as text, with the line in the file at which each row starts."""

    header_line: int
    header: list[str]
    lines: list[int]
    rows: list[list[str]]


def _records(path: str | Path, text: str) -> _Records:
    # Not pandas' reader: it stops at the first uneven row, and cannot tell the line of a row.
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    lines, rows, start = [], [], 1
    try:
        for row in reader:
            if row:
                lines.append(start)
                rows.append(row)
            start = reader.line_num + 1
    except csv.Error as error:
        raise UserError(f"{path} is not valid CSV at line {start}: {error}. Look for a stray quote.") from error
    return _Records(lines[0], rows[0], lines[1:], rows[1:])


def _refuse_other_formats(path: str | Path, header: list[str]) -> None:
    required = set(REQUIRED)
    for separator, name in SEPARATORS.items():
        parts = {part.strip() for part in separator.join(header).split(separator)}
        if len(parts & required) > len(required.intersection(header)):
            raise UserError(f"{path} separates its columns by {name}: save it with commas and decimal points.")
    if not np.isnan(_numbers(header)).any():
        raise UserError(f"{path} has no header: its first line must name the columns {', '.join(REQUIRED)}.")


def _header_faults(header: list[str], line: int) -> list[Fault]:
    faults = []
    for place, name in enumerate(header):
        if not name:
            faults.append(Fault(line, "", "", f"column {place + 1} has no name: name or delete it"))
        elif name in header[:place]:
            faults.append(Fault(line, name, "", f"column appears {header.count(name)} times: keep one"))
    return faults


def _odd_rows(records: _Records) -> list[Fault]:
    """Faults of the rows whose values cannot be given to columns: too many, too few, or all blank."""
    faults, width = [], len(records.header)
    for line, row in zip(records.lines, records.rows, strict=True):
        if len(row) == width and any(map(str.strip, row)):
            continue
        problem = f"has {len(row)} values for {width} columns: "
        if not any(map(str.strip, row)):
            problem = "is blank but for its commas: delete the line"
        elif len(row) > width:
            problem += "look for a decimal comma (write 1.5, not 1,5) or a comma too many"
        else:
            problem += "complete the line"
        faults.append(Fault(line, "", ",".join(row), problem))
    return faults


def _numbers(cells: Sequence[str]) -> np.ndarray:
    """The cells as float64, NaN where one is no finite number."""
    try:
        values = np.fromiter(map(float, cells), np.float64, len(cells))
    except ValueError:
        values = np.array([_number(cell) for cell in cells])
    values[np.isinf(values)] = np.nan
    return values


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan


def _near_optional(header: list[str]) -> list[str]:
    """Warnings about columns whose names nearly are those of optional ones, which are therefore not used."""
    warnings = []
    for name in OPTIONAL:
        if name not in header:
            further = [column for column in header if column not in (*REQUIRED, *OPTIONAL)]
            for near in get_close_matches(name, further, n=1, cutoff=0.75):
                warnings.append(f"Column {near!r} is kept but not used: rename it to {name} if that is meant.")
    return warnings


def _printed(fault: Fault) -> str:
    # repr shows control characters instead of sending them to the terminal.
    column = f", {repr(fault.column)[1:-1]}" if fault.column else ""
    cut = "…" if len(fault.value) > PRINTED_CHARACTERS else ""
    value = f" {fault.value[:PRINTED_CHARACTERS] + cut!r}" if fault.value else ""
    return f"line {fault.line}{column}:{value} {fault.problem}"
