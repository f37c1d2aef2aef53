"""Sheets of workbooks as grids of cells: Excel, OpenDocument, Parquet. Formulas are not calculated, macros not run."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from freelearn.common.errors import UserError
from freelearn.data.intake.readers.cells import Grid, Row, Style, few, is_number, typed_number
from freelearn.data.intake.recipes.recipe import Reading

if TYPE_CHECKING:
    from openpyxl.workbook import Workbook
    from openpyxl.worksheet.worksheet import Worksheet

# The line of a row and its cells as they are typed.
TypedRow = tuple[int, Sequence[Any]]

# A workbook that unpacks to more than this is no laboratory's table [bytes].
LARGEST = 500_000_000
# The rows of an area of cells: C2:C54.
_ROWS_OF = re.compile(r"\$?[A-Z]{1,3}\$?(\d+):\$?[A-Z]{1,3}\$?(\d+)")
# What other archives hold, and what to do about them.
OTHERS = {
    "xl/workbook.bin": "a binary workbook (.xlsb): save it as .xlsx",
    "word/document.xml": "a Word document: copy its table to a spreadsheet and save that as .xlsx",
    "ppt/presentation.xml": "a PowerPoint presentation: save its table as .xlsx or CSV",
    "Index/Document.iwa": "a document of Apple Numbers: export it as .xlsx or CSV",
}


def excel_grid(content: bytes, name: str, reading: Reading) -> Grid:
    """The cells of the sheet that `reading` names, or of the only one that holds something. Raises UserError."""
    _check_archive(content, name)
    sheet = _sheet(_workbook(content, name), name, reading)
    cells = list(enumerate(sheet.iter_rows(values_only=True), start=1))
    rows, texts, typed = as_text(cells, name, reading)
    spread = [f"{name}: cells {area} are merged: each row has their value." for area in _spread(sheet, rows)]
    rows = [(i, cells) for i, cells in rows if any(cells)]
    width = max((len(cells) - _trailing(cells) for _, cells in rows), default=0)
    rows = [(i, cells[:width]) for i, cells in rows]
    _refuse_merged(sheet, rows, name)
    sums = _uncalculated(content, sheet, name)
    hidden = [] if sheet.sheet_state == "visible" else [f"{name}: the sheet {sheet.title!r} is hidden in the workbook."]
    notes = [*hidden, *sums, *spread, *_hidden(sheet, [i for i, _ in rows], name), *typed]
    return Grid(name, rows, notes=notes, texts=texts)


def filled_sheets(content: bytes, name: str) -> list[str]:
    """The names of the sheets that hold something. Raises UserError."""
    _check_archive(content, name)
    return list(_filled(_workbook(content, name)))


def _filled(book: Workbook) -> dict[str, Worksheet]:
    return {s.title: s for s in book.worksheets if any(c.value is not None for row in s.iter_rows() for c in row)}


def _hidden(sheet: Worksheet, lines: list[int], name: str) -> list[str]:
    """Rows that a filter hides are read all the same, and said."""
    hidden = [line for line in lines if line in sheet.row_dimensions and sheet.row_dimensions[line].hidden]
    if not hidden:
        return []
    return [f"{name}: rows that the workbook hides were read like the others: lines {few(hidden)}."]


def _check_archive(content: bytes, name: str) -> None:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
    except zipfile.BadZipFile:
        raise UserError(f"{name} is a damaged .xlsx: open it in a spreadsheet program and save it again.") from None
    inside = [entry.filename for entry in entries]
    for part, what in OTHERS.items():
        if part in inside:
            raise UserError(f"{name} is {what}.")
    if "xl/workbook.xml" not in inside:
        raise UserError(f"{name} is an archive and no workbook: unpack it and name the file in it.")
    if sum(entry.file_size for entry in entries) > LARGEST:
        raise UserError(f"{name} unpacks to more than {LARGEST // 1_000_000} MB: export the one sheet as CSV.")


def _workbook(content: bytes, name: str, values: bool = True) -> Workbook:
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise UserError(
            f"{name}: reading .xlsx needs openpyxl: pip install 'freelearn[excel]', or export the sheet as CSV."
        ) from None
    try:
        return load_workbook(io.BytesIO(content), data_only=values, keep_links=False)
    except Exception as problem:  # openpyxl raises whatever its parts do on a damaged file.
        raise UserError(
            f"{name} cannot be read as .xlsx ({problem}): open it in a spreadsheet program and save it again."
        ) from None


def _sheet(book: Workbook, name: str, reading: Reading) -> Worksheet:
    filled = _filled(book)
    if reading.sheet is not None:
        if reading.sheet not in filled:
            raise UserError(f"{name} has no filled sheet {reading.sheet!r}: it has {', '.join(map(repr, filled))}.")
        return filled[reading.sheet]
    if not filled:
        raise UserError(f"{name} is empty: it needs a header and rows.")
    if len(filled) > 1:
        raise UserError(
            f"{name} has {len(filled)} sheets ({', '.join(map(repr, filled))}): choose one with read: {{sheet: …}}."
        )
    return next(iter(filled.values()))


def _trailing(cells: list[str]) -> int:
    """How many blank cells a row ends with."""
    return next((i for i, cell in enumerate(reversed(cells)) if cell), len(cells))


def _spread(sheet: Worksheet, rows: list[Row]) -> list[str]:
    """Writes the text of merged headings into all of their cells: a name over two rows is that of its column; and a
    value that stands once for several rows into each. Gives the areas of such values."""
    values = []
    for area in sheet.merged_cells.ranges:
        part = [cells for i, cells in rows if area.min_row <= i <= area.max_row]
        text = part[0][area.min_col - 1] if part else ""
        of_rows = any(map(_has_number, part))
        if text and (not of_rows or area.min_col == area.max_col):
            for cells in part:
                cells[area.min_col - 1 : area.max_col] = [text] * (area.max_col - area.min_col + 1)
            values += [str(area)] if of_rows else []
    return values


def _refuse_merged(sheet: Worksheet, rows: list[Row], name: str) -> None:
    """Cells merged across rows of numbers, or one heading over several columns of them: nobody knows the others'."""
    filled = {i for i, cells in rows if _has_number(cells) and 2 * sum(map(bool, cells)) >= len(cells)}
    for area in sheet.merged_cells.ranges:
        if area.max_col > area.min_col and filled & set(range(area.min_row, area.max_row + 2)):
            raise UserError(f"{name}, sheet {sheet.title!r}: cells {area} are merged: unmerge them and fill in each.")


def _has_number(cells: Sequence[str]) -> bool:
    return any(map(is_number, cells))


def _uncalculated(content: bytes, sheet: Worksheet, name: str) -> list[str]:
    """A note on formulas that no program has ever calculated and that sum up other rows: they are blank, and no
    readings. Of others the value is needed."""
    sums = []
    for row in _workbook(content, name, values=False)[sheet.title].iter_rows():
        for cell in row:
            if cell.data_type != "f" or sheet[cell.coordinate].value is not None:
                continue
            if not _sums_up(str(cell.value)):
                raise UserError(
                    f"{name}, sheet {sheet.title!r}: {cell.coordinate} is a formula without a value: open the workbook "
                    "in a spreadsheet program and save it."
                )
            sums.append(f"{cell.coordinate} {cell.value}")
    shown = ", ".join(sums[:3]) + (", …" if sums[3:] else "")
    return [f"{name}: formulas that sum up other cells are no readings and were left out: {shown}."] if sums else []


def _sums_up(formula: str) -> bool:
    """Whether a formula is made of several rows.

    >>> _sums_up("=AVERAGE(C$2:C$54)"), _sums_up("=MAX(D2:D54)-B1"), _sums_up("=C2*10"), _sums_up("=SUM(A2:C2)")
    (True, True, False, False)
    """
    return any(int(last) - int(first) >= 2 for first, last in _ROWS_OF.findall(formula))


# Sheets of other programs as grids of cells: OpenDocument (.ods) and Parquet. Their readers are optional packages.


def absent(name: str, package: str, instead: str = "export the table as CSV") -> UserError:
    """What to do where the package that reads a format is not installed."""
    return UserError(f"{name}: reading it needs {package}: pip install 'freelearn[raw]', or {instead}.")


def is_open_document(content: bytes) -> bool:
    """Whether an archive is an OpenDocument file."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return "content.xml" in archive.namelist()
    except zipfile.BadZipFile:
        return False


def open_document_sheets(content: bytes, name: str) -> dict[str, list[TypedRow]]:
    """Rows by name of the sheet, the filled ones. Raises UserError."""
    try:
        import odf  # noqa: F401
        import pandas as pd
    except ImportError:
        raise absent(name, "odfpy", "save it as .xlsx or CSV") from None
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > LARGEST:
            raise UserError(f"{name} unpacks to more than {LARGEST // 1_000_000} MB: export the one sheet as CSV.")
    try:
        # Cells as they are: a blank is one, and NA a word.
        asked: dict[str, Any] = {"header": None, "dtype": object, "keep_default_na": False, "na_values": [""]}
        sheets = pd.read_excel(io.BytesIO(content), sheet_name=None, engine="odf", **asked)
    except Exception as problem:  # odfpy raises whatever its parts do on a damaged file.
        raise UserError(
            f"{name} cannot be read as an OpenDocument file ({problem}): save it as .xlsx or CSV."
        ) from None
    made = {str(title): list(enumerate(sheet.to_numpy().tolist(), start=1)) for title, sheet in sheets.items()}
    return {title: rows for title, rows in made.items() if any(text_of(v) for _, cells in rows for v in cells)}


def open_document_grid(content: bytes, name: str, reading: Reading) -> Grid:
    """The cells of the sheet that `reading` names, or of the only one. Raises UserError."""
    sheets = open_document_sheets(content, name)
    if not sheets:
        raise UserError(f"{name} is empty: it needs a header and rows.")
    if reading.sheet is not None and reading.sheet not in sheets:
        raise UserError(f"{name} has no filled sheet {reading.sheet!r}: it has {', '.join(map(repr, sheets))}.")
    if reading.sheet is None and len(sheets) > 1:
        shown = ", ".join(map(repr, sheets))
        raise UserError(f"{name} has {len(sheets)} sheets ({shown}): choose one with read: {{sheet: …}}.")
    rows, texts, notes = as_text(sheets[reading.sheet or next(iter(sheets))], name, reading)
    return Grid(name, [(line, cells) for line, cells in rows if any(cells)], notes=notes, texts=texts)


def parquet_grid(content: bytes, name: str, reading: Reading) -> Grid:
    """The columns of a Parquet file. Raises UserError."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise absent(name, "pyarrow") from None
    try:
        table = pq.read_table(io.BytesIO(content))
        columns = [table.column(i).to_pylist() for i in range(table.num_columns)]
    except (pa.ArrowException, OSError, ValueError) as problem:
        raise UserError(f"{name} cannot be read as Parquet ({str(problem)[:100]}): export the table as CSV.") from None
    rows, texts, notes = as_text(list(enumerate(zip(*columns, strict=True), start=2)), name, reading)
    return Grid(name, [(1, [str(title) for title in table.column_names]), *rows], notes=notes, texts=texts)


def as_text(rows: Sequence[TypedRow], name: str, reading: Reading) -> tuple[list[Row], frozenset[str], list[str]]:
    """Rows of typed cells as texts, which of them were texts, and a note on those that are read as numbers all the
    same: with a decimal comma, or as `reading` says."""
    said = reading.decimal or reading.thousands
    style = Style(reading.decimal or ".", reading.thousands or "") if said else None
    made: list[Row] = []
    texts: set[str] = set()
    read: list[tuple[int, str, str]] = []
    for line, values in rows:
        cells = [text_of(value) for value in values]
        for place in (i for i, value in enumerate(values) if isinstance(value, str)):
            number = typed_number(cells[place], style)
            if number is not None and number != cells[place]:
                read.append((line, cells[place], number))
                cells[place] = number
            texts.add(cells[place])
        made.append((line, cells))
    if not read:
        return made, frozenset(texts), []
    line, cell, number = read[0]
    many = f"{len(read)} cells of text were read as numbers" if read[1:] else "a cell of text was read as a number"
    return made, frozenset(texts), [f"{name}: {many} (line {line}: {cell!r} is {number})."]


def text_of(value: Any) -> str:
    """A cell's value as a CSV has it.

    >>> text_of(3.0), text_of(None), text_of(True)
    ('3', '', 'TRUE')
    """
    if value is None or value != value:
        return ""
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, float):
        return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    return str(value).strip()
