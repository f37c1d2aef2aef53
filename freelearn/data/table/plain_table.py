"""Large tables of plain cells, read piece by piece: whatever is odd about one is left to the careful reader.

The careful reader (`records`, `table`) knows the line and the text of every fault, which takes a hundred times the
memory of the numbers. Here a file is read only as long as it could not be read in two ways.
"""

from __future__ import annotations

import io
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pandas as pd

from freelearn.common.files import BYTE_ORDER_MARK, file_size, opened
from freelearn.common.progress import tell

# Smaller files are read carefully at once [bytes].
LARGE = 20_000_000
# Bytes that are looked at together.
PIECE = 1 << 23
# More characters in a line than this are odd: Python's reader takes no cell of so many.
LONGEST_LINE = 100_000
COMMA, NEWLINE, RETURN, QUOTE = b',\n\r"'
# Reads numbers as Python's float() to the last bit. Since pandas 3.1 it always does, and warns where it is asked.
EXACT = {"float_precision": "round_trip"} if tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1) else {}
# What cells of plain numbers are made of, and what parts them.
_OF_NUMBERS = np.zeros(256, dtype=bool)
_OF_NUMBERS[list(b"0123456789.+-eE,\n\r")] = True


class _Odd(Exception):
    """The file holds something that the careful reader has to look at."""


@dataclass(frozen=True)
class PlainTable:
    """header: the columns' names, each once. numbers: float64 of the known columns, NaN where a cell is blank. text:
    cells of the others, as they stand in the file. The rows begin at line 2, one on each line."""

    header: list[str]
    numbers: dict[str, np.ndarray]
    text: dict[str, np.ndarray]

    def __len__(self) -> int:
        return len(next(iter(self.numbers.values())))


def read_plain(path: str | Path, known: Collection[str], required: Collection[str]) -> PlainTable | None:
    """A large file's columns; None where it is small, or odd in any way: quotes, spaces beside numbers, uneven or blank
    lines, text among the known columns' numbers, a required column that is not there, …

    Raises UserError where the file cannot be read."""
    with opened(path) as file:
        total = file_size(file)
        if total < LARGE:
            return None
        try:
            return _read(file, total, known, required)
        except _Odd:
            return None


def _read(file: BinaryIO, total: int, known: Collection[str], required: Collection[str]) -> PlainTable:
    header = _header(file.readline(LONGEST_LINE), required)
    numeric = [place for place, name in enumerate(header) if name in known]
    columns = {header[place]: np.empty(0) for place in numeric}
    text: dict[str, list[np.ndarray]] = {name: [] for name in header if name not in known}
    # Every different cell once, however often it comes.
    words: dict[str, str] = {}
    count, begun = 0, file.tell()
    for piece in _pieces(file):
        cells = _cells(piece, len(header), numeric)
        if count + len(cells) > len(columns[header[numeric[0]]]):
            # Room for the rest, should its lines be as long as those so far. What is not written takes no memory.
            rows = count + len(cells)
            room = rows + int(1.05 * rows * (total - file.tell()) / max(file.tell() - begun, 1))
            for name in columns:
                columns[name].resize(room, refcheck=False)
        for place, name in enumerate(header):
            if name in columns:
                columns[name][count : count + len(cells)] = cells[place].to_numpy()
            else:
                shared = [words.setdefault(cell, cell) for cell in cells[place]]
                text[name].append(np.array(shared, dtype=object))
        count += len(cells)
        tell("reading", file.tell(), total)
    if not count:
        raise _Odd
    for name in columns:
        columns[name].resize(count, refcheck=False)
        if np.isinf(columns[name].max(initial=0)) or np.isinf(columns[name].min(initial=0)):
            raise _Odd  # more than a computer holds
    return PlainTable(header, columns, {name: np.concatenate(parts) for name, parts in text.items()})


def _header(line: bytes, required: Collection[str]) -> list[str]:
    """The columns' names, of which none is missing, blank or there twice."""
    try:
        text = line.decode("utf-8").removeprefix(BYTE_ORDER_MARK)
    except UnicodeDecodeError:
        raise _Odd from None
    if not text.endswith("\n") or any(mark in text.removesuffix("\n").removesuffix("\r") for mark in '"\r\0'):
        raise _Odd
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names) or not set(required) <= set(names):
        raise _Odd
    if any(BYTE_ORDER_MARK in name for name in names):
        raise _Odd
    return names


def _pieces(file: BinaryIO) -> Iterator[bytes]:
    """The rest of the file in pieces of whole lines."""
    left = b""
    while read := file.read(PIECE):
        end = read.rfind(b"\n") + 1
        if not end and len(left) > LONGEST_LINE:
            raise _Odd
        if end:
            yield left + read[:end]
            left = b""
        left += read[end:]
    if left:
        yield left + b"\n"


def _cells(piece: bytes, width: int, numeric: Sequence[int]) -> pd.DataFrame:
    """The cells of some lines: floats in the numeric columns, NaN where they are blank, and text in the others."""
    content = np.frombuffer(piece, dtype=np.uint8)
    ends = np.flatnonzero((content == COMMA) | (content == NEWLINE))
    lines = np.flatnonzero(content == NEWLINE)
    # As many commas in every line, and so no blank one either.
    if len(ends) != len(lines) * width or not np.array_equal(ends[width - 1 :: width], lines):
        raise _Odd
    returns = np.flatnonzero(content == RETURN)
    if len(returns) and not (content[returns + 1] == NEWLINE).all():
        raise _Odd
    if np.diff(lines, prepend=-1).max() > LONGEST_LINE or not content.all() or (content == QUOTE).any():
        raise _Odd
    other = np.flatnonzero(~_OF_NUMBERS[content])
    if len(other):
        within = np.zeros(width, dtype=bool)
        within[list(numeric)] = True
        if within[np.searchsorted(ends, other) % width].any():
            raise _Odd
        _decodes(piece)
    starts = np.r_[0, ends[:-1] + 1]
    blank = (ends == starts) | ((ends == starts + 1) & (content[starts] == RETURN))
    gaps = [place for place in numeric if blank[place::width].any()]
    kinds = dict.fromkeys(range(width), "str") | dict.fromkeys(numeric, "float64")
    try:
        return pd.read_csv(
            io.BytesIO(piece),
            header=None,
            names=list(range(width)),
            index_col=False,
            dtype=kinds,
            **EXACT,
            na_filter=bool(gaps),
            na_values={place: [""] for place in gaps},
            keep_default_na=False,
            quoting=3,  # csv.QUOTE_NONE: there are no quotes
            skip_blank_lines=False,
            low_memory=False,
            encoding="utf-8",
        )
    except (ValueError, pd.errors.ParserError):
        raise _Odd from None


def _decodes(piece: bytes) -> None:
    try:
        piece.decode("utf-8")
    except UnicodeDecodeError:
        raise _Odd from None
