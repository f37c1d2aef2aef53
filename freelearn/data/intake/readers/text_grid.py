"""Text as a grid of cells: its encoding, separator and decimal mark, found where nobody says them."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterator

from freelearn.common.errors import UserError
from freelearn.data.intake.readers.cells import Grid, Row, Style, is_blank, is_number
from freelearn.data.intake.readers.labview_text import is_labview, table_lines
from freelearn.data.intake.recipes.recipe import Reading

# The text in a file's bytes: its encoding, found where nobody says it, without what cannot be seen.

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
CONTROL = re.compile(r"[\x00-\x08\x0e-\x1b]")
# Text has at most so many control characters; more make it binary.
FEW = 20
# DOS ended texts so.
END_OF_FILE = "\x1a"
# Marks of order, joints and spaces without width, which are copied along from web pages and chats.
INVISIBLE = dict.fromkeys(map(ord, "\u200b\u200c\u200d\u200e\u200f\u2060\ufeff\u00ad"))


def _japanese(content: bytes) -> bool:
    """Whether bytes that are no UTF-8 are Shift-JIS: its leading bytes mean little in western texts."""
    high = [byte for byte in content if byte > 0x7F]
    leading = sum(0x81 <= byte <= 0x9F for byte in high)
    if leading < 2 or 3 * leading < len(high):
        return False
    try:
        content.decode("utf-8")
    except UnicodeError:
        try:
            content.decode("cp932")
        except UnicodeError:
            return False
        return True
    return False


def decoded(content: bytes, name: str, encoding: str | None) -> tuple[str, list[str]]:
    """The text, and a note where its encoding had to be guessed. Raises UserError where it is none."""
    guessed = next((code for mark, code in MARKS if content.startswith(mark)), None)
    if encoding is None and guessed is None and b"\0" in content[:4000]:
        odd, even = content[1:4000:2].count(0), content[0:4000:2].count(0)
        # Of western text in UTF-16 nearly every other byte is zero.
        half = 0.25 * min(len(content), 4000)
        guessed = "utf-16-le" if odd > half > even else "utf-16-be" if even > half > odd else None
    if encoding is None and guessed is None and _japanese(content):
        guessed = "cp932"
    control = ""
    for code in [encoding] if encoding else [guessed or "utf-8", "cp1252", "latin-1"]:
        try:
            text = content.decode(code)
        except LookupError:
            raise UserError(f"read.encoding = {encoding!r} is no encoding: write utf-8, utf-16 or cp1252.") from None
        except UnicodeError:
            continue
        text = text.translate(INVISIBLE).rstrip(END_OF_FILE)
        if found := CONTROL.search(text):
            control = (
                f"control character 0x{ord(found.group()):02X} on line {1 + text.count(chr(10), 0, found.start())}"
            )
            break
        notes = [] if code in ("utf-8", "utf-8-sig") or encoding else [f"{name}: read as {code} text."]
        return text, notes
    if encoding:
        raise UserError(f"{name} is not {encoding} text{control and f' ({control})'}: correct read.encoding.")
    if control and "0x00" not in control and len(CONTROL.findall(text)) <= FEW:
        raise UserError(f"{name} is damaged, or a binary file: {control}: delete it, or export the table again.")
    raise UserError(f"{name} is a binary file, not text: export the table as CSV, or save it as .xlsx.")


# Text as a grid of cells: its separator and decimal mark, found where nobody says them.

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
    if is_labview(lines):
        lines, separator, said = table_lines(lines, name)
        notes += said
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
    first = next((place for place, (_, row) in enumerate(rows) if any(map(is_number, row)) and len(row) > 1), 0)
    header = next((row for _, row in reversed(rows[:first]) if len(row) > 1), None)
    widths = [len(row) for _, row in rows if any(map(is_number, row))]
    if header and widths and min(widths) == 2 * len(header):
        raise UserError(
            f"{name} separates columns by commas and has decimal commas: export it with semicolons between the columns."
        )
