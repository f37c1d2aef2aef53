"""Files that are taken in, whatever their format, as tables of text; what cannot be read says what to do instead."""

from __future__ import annotations

import io
import json
import re
import zipfile
from difflib import get_close_matches
from pathlib import Path

from freelearn.common.errors import UserError
from freelearn.common.files import read_bytes
from freelearn.data.intake.readers.cells import Grid
from freelearn.data.intake.readers.grid_table import table_of
from freelearn.data.intake.readers.matlab_reader import NUMPY
from freelearn.data.intake.readers.matlab_table import matlab_table, structures_of
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.readers.sheets import (
    excel_grid,
    filled_sheets,
    is_open_document,
    open_document_grid,
    open_document_sheets,
    parquet_grid,
)
from freelearn.data.intake.readers.text_grid import text_grid
from freelearn.data.intake.recipes.recipe import Reading, Recipe

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
    if is_matlab(content, name):
        return matlab_table(content, name, reading)
    if content.startswith(b"PAR1"):
        return table_of(parquet_grid(content, name, reading), reading)
    if content.startswith(b"PK\x03\x04") and is_open_document(content):
        return table_of(open_document_grid(content, name, reading), reading)
    if content.startswith(b"PK\x03\x04"):
        return table_of(excel_grid(content, name, reading), reading)
    if name.lower().endswith((".xlsx", ".xlsm")):
        raise UserError(f"{name} is no .xlsx workbook in spite of its name: save it as .xlsx again, or rename it.")
    return table_of(text_grid(content, name, reading), reading)


def sheet_grid(content: bytes, name: str, sheet: str) -> Grid:
    """The cells of one sheet of a workbook; a MATLAB file has none. Raises UserError."""
    if is_matlab(content, name):
        return Grid(name, [])
    reader = open_document_grid if is_open_document(content) else excel_grid
    return reader(content, name, Reading(sheet=sheet))


def is_matlab(content: bytes, name: str) -> bool:
    """Whether it is read as a MATLAB file is, HDF5 and NumPy's arrays among them."""
    known = (b"MATLAB 5.0", b"MATLAB 7.3", HDF, NUMPY)
    return content.startswith(known) or name.lower().endswith(".mat") or _is_npz(content)


def _is_npz(content: bytes) -> bool:
    """Whether an archive holds NumPy's arrays, and nothing else."""
    if not content.startswith(b"PK\x03\x04"):
        return False
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return all(name.endswith(".npy") for name in archive.namelist())
    except zipfile.BadZipFile:
        return False


def sheet_names(content: bytes, name: str) -> list[str]:
    """The filled sheets of a workbook, the structures of a MATLAB file; none where there is but one place to read.
    Raises UserError where it cannot be read."""
    if is_matlab(content, name):
        return structures_of(content, name)
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


# The files that are taken in: one, or those of a folder.

ENDINGS = (
    ".csv",
    ".txt",
    ".tsv",
    ".dat",
    ".xlsx",
    ".ods",
    ".mat",
    ".h5",
    ".hdf5",
    ".npz",
    ".npy",
    ".parquet",
    ".lvm",
    ".asc",
)


def is_folder(path: Path) -> bool:
    """Whether there is a folder of that name; of names that no file can have, there is none."""
    try:
        return path.is_dir()
    except OSError:
        return False


def read_sources(data: Path, recipe: Recipe) -> dict[str, bytes]:
    """Name → bytes of the file, or of the files in the folder that the recipe lists. Raises UserError."""
    if not any(part.name for part in recipe.files):
        if is_folder(data):
            raise UserError(f"{data} is a folder: name one file in it, or list its files in the recipe under files:.")
        return {data.name: read_bytes(data)} | _joined_sources(data.parent, recipe)
    folder = data if is_folder(data) else data.parent
    if not is_folder(data) and {part.name for part in recipe.files} != {data.name}:
        raise UserError(f"The recipe lists several files, and {data} is one: give their folder as data.path.")
    lacking = [part.name for part in recipe.files if not (folder / part.name).is_file()]
    if lacking:
        there = [path.name for path in _inside(folder)]
        near = get_close_matches(lacking[0], there, n=1)
        hint = f": did you mean {near[0]}?" if near else "."
        raise UserError(f"files of the recipe names {lacking[0]}, which is not in {folder}{hint}")
    listed = {part.name: read_bytes(folder / part.name) for part in recipe.files}
    return listed | _joined_sources(folder, recipe)


def _joined_sources(folder: Path, recipe: Recipe) -> dict[str, bytes]:
    """Name → bytes of the files whose channels the recipe joins. Raises UserError."""
    names = recipe.joined_files()
    for name in names:
        if not (folder / name).is_file():
            raise UserError(
                f"join of the recipe names {name}, which is not beside the data in {folder}: correct file:."
            )
    return {name: read_bytes(folder / name) for name in names}


def table_files(folder: Path) -> list[str]:
    """Names of the files in a folder that may hold tables, in order; where there are none, those in the folders inside
    it, test1/force.csv. Raises UserError where there is none."""
    inside = _inside(folder)
    deeper = (path for one in inside if one.is_dir() and not one.name.startswith(".") for path in _inside(one))
    found = [path for path in inside if _may_hold(path)] or [path for path in deeper if _may_hold(path)]
    names = sorted((path.relative_to(folder).as_posix() for path in found), key=in_natural_order)
    if not names:
        raise UserError(f"{folder} holds no tables ({', '.join(ENDINGS)}): name the file.")
    return names


def _may_hold(path: Path) -> bool:
    return path.suffix.lower() in ENDINGS and path.is_file()


def in_natural_order(name: str) -> list[tuple[int, str]]:
    """By which names are sorted as people do.

    >>> sorted(["test10", "test2"], key=in_natural_order)
    ['test2', 'test10']
    """
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name)]


def _inside(folder: Path) -> list[Path]:
    """What a folder holds. Raises UserError where that cannot be told."""
    try:
        return list(folder.iterdir())
    except (OSError, ValueError) as problem:
        raise UserError(f"{folder} cannot be read: {getattr(problem, 'strerror', None) or problem}.") from None
