"""A laboratory's file, whatever its format, as a table of text; what cannot be read says what to do instead."""

from __future__ import annotations

import json

from freelearn.errors import UserError
from freelearn.measurements.intake.excel_grid import excel_grid, filled_sheets
from freelearn.measurements.intake.further_grids import (
    is_open_document,
    open_document_grid,
    open_document_sheets,
    parquet_grid,
)
from freelearn.measurements.intake.grid import Grid
from freelearn.measurements.intake.grid_table import table_of
from freelearn.measurements.intake.matlab_table import matlab_table
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.reading import Reading
from freelearn.measurements.intake.text_grid import text_grid

HDF = b"\x89HDF"
EXPORT = "export the table as CSV, or save it as .xlsx"
# First bytes → what such a file is and what to do.
REFUSED = (
    (b"\x1f\x8b", "is compressed (gzip): unpack it first"),
    (b"BZh", "is compressed (bzip2): unpack it first"),
    (b"\xfd7zXZ", "is compressed (xz): unpack it first"),
    (b"7z\xbc\xaf", "is an archive (7z): unpack it first"),
    (b"\xd0\xcf\x11\xe0", "is an old or encrypted Excel workbook (.xls): save it as .xlsx without a password"),
    (b"%PDF", f"is a PDF: {EXPORT}"),
    (b"\x89PNG", f"is a picture: {EXPORT}"),
    (b"\xff\xd8\xff", f"is a picture: {EXPORT}"),
    (b"SQLite format 3", f"is a database: {EXPORT}"),
    (b"\x93NUMPY", f"is a NumPy array: {EXPORT}"),
    (b"TDSm", f"is a LabVIEW TDMS file: {EXPORT}"),
)
# Stands in workbooks with a password, in UTF-16.
PASSWORD = "EncryptedPackage".encode("utf-16-le")
PICKLES = tuple(b"\x80" + bytes([version]) for version in range(1, 6))
MARKUP = (b"<html", b"<!doctype", b"<table", b"<?xml", b"<meta", b"<head")


def raw_table(content: bytes, name: str, reading: Reading | None = None) -> RawTable:
    """The table in a file's bytes. name: the file's. Raises UserError. Nothing in it is executed."""
    reading = reading or Reading()
    if not content.strip():
        raise UserError(f"{name} is empty: it needs a header and rows.")
    _refuse(content, name)
    if content.startswith((b"MATLAB 5.0", b"MATLAB 7.3", HDF)) or name.lower().endswith(".mat"):
        return matlab_table(content, name, reading)
    if content.startswith(b"PAR1"):
        return table_of(parquet_grid(content, name), reading)
    if content.startswith(b"PK\x03\x04") and is_open_document(content):
        return table_of(open_document_grid(content, name, reading), reading)
    if content.startswith(b"PK\x03\x04"):
        return table_of(excel_grid(content, name, reading), reading)
    if name.lower().endswith((".xlsx", ".xlsm")):
        raise UserError(f"{name} is no .xlsx workbook in spite of its name: save it as .xlsx again, or rename it.")
    return table_of(text_grid(content, name, reading), reading)


def sheet_grid(content: bytes, name: str, sheet: str) -> Grid:
    """The cells of one sheet of a workbook. Raises UserError."""
    reader = open_document_grid if is_open_document(content) else excel_grid
    return reader(content, name, Reading(sheet=sheet))


def sheet_names(content: bytes, name: str) -> list[str]:
    """The filled sheets of a workbook; of other files none. Raises UserError where it cannot be read."""
    if content.startswith(b"PK\x03\x04") and is_open_document(content):
        return list(open_document_sheets(content, name))
    return filled_sheets(content, name) if content.startswith(b"PK\x03\x04") else []


def _is_json(content: bytes) -> bool:
    try:
        json.loads(content)
    except (ValueError, RecursionError):
        return False
    return True


def _refuse(content: bytes, name: str) -> None:
    start = content[:512].lstrip().lower()
    if start.removeprefix(b"\xef\xbb\xbf").startswith(MARKUP):
        raise UserError(f"{name} is a web page or XML under another name: open it in a spreadsheet and save as .xlsx.")
    if content.startswith(PICKLES) or name.lower().endswith((".pkl", ".pickle")):
        raise UserError(f"{name} is a pickle, which could run code and is never opened: export the table as CSV.")
    if content.startswith(b"\xd0\xcf\x11\xe0") and PASSWORD in content:
        raise UserError(f"{name} is a workbook with a password: save it as .xlsx without one.")
    if start[:1] in (b"{", b"[") and _is_json(content):
        raise UserError(f"{name} is JSON, not a table: export the table as CSV.")
    for mark, what in REFUSED:
        if content.startswith(mark):
            raise UserError(f"{name} {what}.")
