"""Text as a grid of cells: its separator and decimal mark, found where nobody says them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator

from freelearn.errors import UserError
from freelearn.measurements.intake.cells import Style, is_blank, is_number
from freelearn.measurements.intake.grid import Grid, Row
from freelearn.measurements.intake.reading import Reading
from freelearn.measurements.intake.text_encoding import decoded

SEPARATORS = (",", ";", "\t", "|", " ")
NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", " ": "spaces"}
COMMENTS = ("#", "%", "//", ";;")
# Rows by which separator and decimal mark are judged, and cells of each.
JUDGED, CELLS_JUDGED = 300, 300


def text_grid(content: bytes, name: str, reading: Reading) -> Grid:
    """The cells of a text file. Raises UserError where it is no text, or no table."""
    text, notes = decoded(content, name, reading.encoding)
    # Not str.splitlines, for which form feeds and their like end lines, too.
    lines = list(io.StringIO(text, newline=None))
    separator = reading.separator or ""
    if lines and (told := re.fullmatch(r"sep=(.)\s*", lines[0])):
        separator, lines[0] = separator or told.group(1), "\n"
    plain = [line for line in lines if line.strip() and not _is_comment(line)]
    if not plain:
        raise UserError(f"{name} is empty: it needs a header and rows.")
    separator = separator or _separator(plain)
    rows = list(_rows(lines, separator, name))
    style = _style(rows, separator, reading)
    _refuse_commas(rows, separator, name)
    if separator != ",":
        notes.append(f"{name}: columns are separated by {NAMES.get(separator, repr(separator))}.")
    if style.decimal == ",":
        notes.append(f"{name}: numbers have decimal commas.")
    remarks = [(i, _remark(line, separator)) for i, line in enumerate(lines, start=1) if _is_comment(line)]
    return Grid(name, rows, style, notes, cut_off=not text.endswith(("\n", "\r")), comments=remarks)


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENTS)


def _remark(line: str, separator: str) -> list[str]:
    """The cells of a comment; of one with spaces between its words they are one."""
    text = line.strip().lstrip("#%/; ")
    return [text] if separator == " " else text.split(separator)


def _rows(lines: list[str], separator: str, name: str) -> Iterator[Row]:
    """The lines' cells; of the comments before the first row the last, if it names the columns of a file without a
    header."""
    comment: Row | None = None
    begun = False
    for number, cells in _records(lines, separator, name):
        if not any(cell.strip() for cell in cells):
            continue
        if cells[0].lstrip().startswith(COMMENTS):
            comment = comment if begun else (number, [cells[0].lstrip("#%/; "), *cells[1:]])
            continue
        if not begun and comment and _names(comment[1], cells):
            yield comment
        begun = True
        yield number, cells


def _names(comment: list[str], row: list[str]) -> bool:
    return len(comment) == len(row) > 1 and any(map(is_number, row)) and not any(map(is_number, comment))


def _records(lines: list[str], separator: str, name: str) -> Iterator[Row]:
    if separator == " ":
        for number, line in enumerate(lines, start=1):
            yield number, line.split()
        return
    reader, start = csv.reader(lines, delimiter=separator, strict=True), 1
    try:
        for cells in reader:
            yield start, cells
            start = reader.line_num + 1
    except csv.Error as problem:
        raise UserError(f"{name}, line {start}: {problem}. Look for a stray quote.") from None


def _separator(lines: list[str]) -> str:
    """The separator that leaves most numbers; a comma where none does."""
    some = lines[:JUDGED]
    scores = {separator: _score(some, separator) for separator in SEPARATORS}
    best = max(SEPARATORS, key=lambda separator: scores[separator])
    return best if scores[best] > 0 else ","


def _score(lines: list[str], separator: str) -> float:
    """The share of cells that are numbers or blank, if the columns were separated so; 0 where there is one column."""
    if separator == " ":
        rows = [line.split() for line in lines]
    else:
        try:
            rows = list(csv.reader(lines, delimiter=separator))
        except csv.Error:
            return 0.0
    wide = [row for row in rows if len(row) > 1]
    cells = [cell for row in wide for cell in row[:CELLS_JUDGED]]
    if 2 * len(wide) < len(rows) or not cells:
        return 0.0
    numeric = sum(is_number(cell) or is_blank(cell) for cell in cells) / len(cells)
    widths = [len(row) for row in rows]
    return numeric * max(map(widths.count, set(widths))) / len(widths) + 1e-6


def _style(rows: list[Row], separator: str, reading: Reading) -> Style:
    decimal = reading.decimal
    if decimal is None:
        cells = [cell.strip() for _, row in rows[:JUDGED] for cell in row[:CELLS_JUDGED]]
        commas = sum(bool(re.fullmatch(r"[+-]?\d*,\d+([eE][+-]?\d+)?", cell)) for cell in cells)
        points = sum(bool(re.fullmatch(r"[+-]?\d*\.\d+([eE][+-]?\d+)?", cell)) for cell in cells)
        decimal = "," if commas > points and reading.thousands != "," and not _grouped(cells) else "."
    return Style(decimal, reading.thousands or "")


def _grouped(cells: list[str]) -> bool:
    """Whether every comma stands before three digits: then it may separate thousands, and nobody can tell."""
    with_comma = [cell for cell in cells if re.fullmatch(r"[+-]?\d+,\d+", cell)]
    return all(re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", cell) for cell in with_comma)


def _refuse_commas(rows: list[Row], separator: str, name: str) -> None:
    """A table with commas between the columns and in the numbers cannot be read by anyone."""
    if separator != "," or len(rows) < 3:
        return
    header = next((row for _, row in rows if not any(map(is_number, row)) and len(row) > 1), None)
    widths = [len(row) for _, row in rows if any(map(is_number, row))]
    if header and widths and min(widths) == 2 * len(header):
        raise UserError(
            f"{name} separates columns by commas and has decimal commas: export it with semicolons between the columns."
        )
