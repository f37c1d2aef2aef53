"""The fields of a CSV file as text, each row with its line; and rows marked as left out, in a copy of that text."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from freelearn.common.errors import UserError
from freelearn.common.files import BYTE_ORDER_MARK, read_text
from freelearn.data.columns import LEFT_OUT
from freelearn.data.table.faults import PLAIN, Fault

SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars", " ": "spaces"}
# No table has so many; names are compared with each other.
MOST_COLUMNS = 10_000


@dataclass(frozen=True)
class Records:
    """The fields of a CSV file as text, with the line in the file at which each row starts."""

    header_line: int
    header: list[str]
    lines: list[int]
    rows: list[list[str]]


def read_records(path: str | Path) -> Records:
    """The fields of a CSV file. Raises UserError where it cannot be read as such."""
    # Not pandas' reader: it stops at the first uneven row, and cannot tell the line of a row.
    reader = csv.reader(io.StringIO(read_text(path), newline=""), strict=True)
    lines, rows, start = [], [], 1
    try:
        for row in reader:
            if row:
                lines.append(start)
                rows.append(row)
            start = reader.line_num + 1
    except csv.Error as error:
        raise UserError(f"{path} is not valid CSV at line {start}: {error}. Look for a stray quote.") from error
    if separator_line(rows[0]) and len(rows) > 1:
        del lines[0], rows[0]
    if len(rows[0]) > MOST_COLUMNS:
        raise UserError(f"{path} has {len(rows[0])} columns, more than any table has: look at line {lines[0]}.")
    return Records(lines[0], rows[0], lines[1:], rows[1:])


def separator_line(row: Sequence[str]) -> bool:
    """Whether a first line only says that commas separate the columns, as spreadsheets read it.

    >>> separator_line(["sep=", ""])
    True
    """
    return list(row) == ["sep=", ""]


def refuse_separators(path: str | Path, header: Sequence[str], known: Collection[str]) -> None:
    """Raises UserError where a header holds more of the known names once it is cut at anything but commas."""
    for separator, name in SEPARATORS.items():
        parts = {part.strip() for part in separator.join(header).split(separator)}
        told = list(header) == [f"sep={separator}".strip()]
        if told or len(parts & set(known)) > len(set(known).intersection(header)):
            raise UserError(f"{path} separates its columns by {name}: save it with commas and decimal points.")


def refuse_other_formats(path: str | Path, header: Sequence[str], known: Collection[str], usual: Iterable[str]) -> None:
    """Raises UserError where a file has no header, or cuts its columns at anything but commas. usual: columns of a
    whole file."""
    refuse_separators(path, header, known)
    if not np.isnan(numbers_of(header)).any():
        raise UserError(f"{path} has no header: its first line must name the columns {', '.join(usual)}.")


def nearly_named(header: Sequence[str], names: Iterable[str], known: Collection[str]) -> list[str]:
    """Sentences on unknown columns that are called nearly as one of these names, which is absent."""
    further = [column for column in header if column not in known]
    return [
        f"Column {near!r} is kept but not used: rename it to {name} if that is meant."
        for name in names
        if name not in header
        for near in get_close_matches(name, further, n=1, cutoff=0.75)
    ]


def columns_of(records: Records, header: Sequence[str]) -> tuple[dict[str, Sequence[str]], list[int], list[Fault]]:
    """The cells of each column (of several with one name those of the first), the lines of the rows that they stand in,
    and the faults of the header and of all other rows. header: names in place of those in the file."""
    faults = [*_header_faults(header, records.header_line), *_odd_rows(records)]
    odd = {fault.line for fault in faults}
    lines = [line for line in records.lines if line not in odd]
    rows = (row for line, row in zip(records.lines, records.rows, strict=True) if line not in odd)
    cells = zip(*rows, strict=True) if lines else [()] * len(header)
    text: dict[str, Sequence[str]] = {}
    for name, column in zip(header, cells, strict=True):
        text.setdefault(name, column)
    return text, lines, faults


def _header_faults(header: Sequence[str], line: int) -> list[Fault]:
    """Faults of columns without a name, or with the name of another one."""
    faults, counts, seen = [], Counter(header), set[str]()
    for place, name in enumerate(header):
        if not name:
            faults.append(Fault(line, "", "", f"column {place + 1} has no name: name or delete it"))
        elif name in seen:
            faults.append(Fault(line, name, "", f"column appears {counts[name]} times: keep one"))
        seen.add(name)
    return faults


def _odd_rows(records: Records) -> list[Fault]:
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


def numbers_of(cells: Sequence[str]) -> np.ndarray:
    """The cells as float64, NaN where one is no finite number: digits with a decimal point, perhaps an exponent."""
    values = _fast(cells)
    if values is None:
        values = np.array([float(bare) if PLAIN.fullmatch(bare := cell.strip()) else np.nan for cell in cells])
    values[np.isinf(values)] = np.nan
    return values


def _fast(cells: Sequence[str]) -> np.ndarray | None:
    """The same, many times as fast; None where a cell may not be what float() takes it for."""
    joined = "".join(cells)
    # float() also takes 1_000, and digits of every script.
    if "_" in joined or not joined.isascii():
        return None
    try:
        return np.fromiter(map(float, cells), np.float64, len(cells))
    except ValueError:
        return None


# Marking rows of a user's table as left out, in a copy that is otherwise the user's own text.


def mark_left_out(content: bytes, lines: Collection[int]) -> bytes:
    r"""A table's file with left_out = 1 in the rows that begin at these lines, and everything else as it stood.

    content: UTF-8 text of a table that `read_table` accepts. Rows keep their lines, cells their text; a column
    left_out is added where there is none, blank in the other rows.

    >>> mark_left_out(b"sample,note\r\n3,a\r\n3,b\r\n", [3])
    b'sample,note,left_out\r\n3,a,\r\n3,b,1\r\n'
    """
    text = content.decode("utf-8")
    bare = text.lstrip(BYTE_ORDER_MARK)
    mark, text = text[: len(text) - len(bare)], bare
    raw = list(io.StringIO(text, newline=""))
    reader = csv.reader(raw, strict=True)
    parts: list[str] = []
    start, place, new, begun = 0, -1, False, False
    for row in reader:
        piece, line, start = "".join(raw[start : reader.line_num]), start + 1, reader.line_num
        if not begun and separator_line(row):
            begun = True
        elif row and place < 0:
            header = [name.strip() for name in row]
            new = LEFT_OUT not in header
            place = len(header) if new else header.index(LEFT_OUT)
            piece = _appended(piece, LEFT_OUT) if new else piece
        elif row and new:
            piece = _appended(piece, "1" if line in lines else "")
        elif row and line in lines:
            piece = _exchanged(piece, row, place)
        parts.append(piece)
    return (mark + "".join(parts)).encode()


def _appended(piece: str, cell: str) -> str:
    """A row's text with one more cell before its line end."""
    body = piece.rstrip("\r\n")
    return f"{body},{cell}{piece[len(body) :]}"


def _exchanged(piece: str, row: list[str], place: int) -> str:
    """A row's text with 1 in one of its cells."""
    ending = piece[len(piece.rstrip("\r\n")) :]
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator=ending).writerow([*row[:place], "1", *row[place + 1 :]])
    return text.getvalue()
