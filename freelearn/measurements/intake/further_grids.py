"""Sheets of other programs as grids of cells: OpenDocument (.ods) and Parquet. Their readers are optional packages."""

from __future__ import annotations

import io
import zipfile
from typing import Any

from freelearn.errors import UserError
from freelearn.measurements.intake.grid import Grid, Row
from freelearn.measurements.intake.reading import Reading

# What unpacks to more is no laboratory's table [bytes].
LARGEST = 500_000_000


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


def open_document_sheets(content: bytes, name: str) -> dict[str, list[Row]]:
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
    made = {
        str(title): [(i, [text_of(v) for v in row]) for i, row in enumerate(sheet.to_numpy().tolist(), start=1)]
        for title, sheet in sheets.items()
    }
    return {title: rows for title, rows in made.items() if any(any(cells) for _, cells in rows)}


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
    rows = sheets[reading.sheet or next(iter(sheets))]
    return Grid(name, [(line, cells) for line, cells in rows if any(cells)])


def parquet_grid(content: bytes, name: str) -> Grid:
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
    rows = [(i, [text_of(v) for v in row]) for i, row in enumerate(zip(*columns, strict=True), start=2)]
    return Grid(name, [(1, [str(title) for title in table.column_names]), *rows])


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
