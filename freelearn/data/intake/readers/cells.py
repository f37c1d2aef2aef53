"""Cells of a laboratory's file as numbers: strict, because a guessed digit is worse than a refused one."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from freelearn.common.errors import UserError

# What instruments and spreadsheets write where there is no number.
BLANKS = {
    "",
    "-",
    "--",
    "---",
    "na",
    "n/a",
    "#n/a",
    "nan",
    "none",
    "null",
    "nil",
    "#div/0!",
    "#value!",
    "#ref!",
    "#num!",
}
# What stands between groups of digits.
GROUPS = (",", ".", " ", "'", "’", "\u00a0", "\u202f")
# A number may carry at most this many characters: beyond, it is no reading.
LONGEST = 40

_POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,3})?", re.ASCII)
_COMMA = re.compile(r"[+-]?(\d+,?\d*|,\d+)([eEdD][+-]?\d{1,3})?", re.ASCII)
# What word processors make of a minus sign.
_DASH = re.compile(r"^[\u2010-\u2013\u2212\ufe63\uff0d](?=[\d.,])|(?<=[eE])\u2212")
# 25.02.2026, 2026-02-25 10:00, 2/25/26; 02. Mai, May-25: what spreadsheets make of 25.2 or 5-25.
_DATE = re.compile(
    r"\d{1,4}([-./])\d{1,2}\1\d{2,4}([ T].*)?|\d{1,2}[-. ]+[^\W\d]{3,9}\.?([-. ]+\d{2,4})?|[^\W\d]{3}-\d{2}"
)
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}([ ,.'’_\u00a0\u202f]\d{3})+([.,]\d+)?")


@dataclass(frozen=True)
class Style:
    """How a file writes numbers. decimal: point or comma. thousands: what separates groups of digits, or ""."""

    decimal: str = "."
    thousands: str = ""

    def number(self, cell: str) -> float | None:
        """The cell's number; None where it is none, NaN where it is blank.

        >>> Style(",").number("1,5"), Style(",", ".").number("1.234,5"), Style(",", ".").number("1,234.5")
        (1.5, 1234.5, None)
        """
        text = _DASH.sub("-", cell.strip())
        if text.lower() in BLANKS:
            return np.nan
        if self.thousands and self.thousands in text:
            whole, _, fraction = text.partition(self.decimal)
            first, *groups = whole.split(self.thousands)
            if self.thousands in fraction or not first or any(len(group) != 3 for group in groups):
                return None
            text = text.replace(self.thousands, "")
        pattern = _COMMA if self.decimal == "," else _POINT
        if len(text) > LONGEST or not pattern.fullmatch(text):
            return None
        return float(text.replace(",", ".").lower().replace("d", "e"))


POINTS = Style()


@dataclass(frozen=True)
class Numbers:
    """values: (N,) float64, NaN where a cell is blank or no number. bad: {row: what is wrong}. words: of each that
    stands for a missing number, how often."""

    values: np.ndarray
    bad: dict[int, str]
    words: dict[str, int]


def numbers(cells: Sequence[str], style: Style) -> Numbers:
    """The cells of a column as numbers."""
    values = _fast(cells, style)
    if values is not None:
        return Numbers(values, {}, {})
    values, bad, words = np.full(len(cells), np.nan), {}, Counter[str]()
    # Of long columns that are no plain numbers most cells are alike: blank, or of a channel with few levels.
    known = {cell: style.number(cell) for cell in set(cells)}
    for row, cell in enumerate(cells):
        value = known[cell]
        if value is None or np.isinf(value):
            bad[row] = problem(cell, style)
        else:
            values[row] = value
            if np.isnan(value) and cell.strip():
                words[cell.strip()] += 1
    return Numbers(values, bad, dict(words))


def is_number(cell: str, style: Style | None = None) -> bool:
    """Whether the cell holds a number, in this style or in any."""
    styles = [style] if style else [Style("."), Style(",")]
    return any((value := s.number(cell)) is not None and not np.isnan(value) for s in styles)


def is_blank(cell: str) -> bool:
    """Whether the cell holds nothing, or a word for it."""
    return cell.strip().lower() in BLANKS


def is_date(cell: str) -> bool:
    """Whether the cell says a date."""
    return _DATE.fullmatch(cell.strip()) is not None


def problem(cell: str, style: Style) -> str:
    """What is wrong with a cell that is no number, and what to do about it."""
    text = cell.strip()
    bare = text.lstrip("+-")
    if bare.lower() in ("inf", "infinity", "∞", "1.#inf", "ol", "over", "overload"):
        return "is not a finite number: leave its row out with drop:, or blank the cell"
    if is_date(text):
        return "is a date: a spreadsheet may have made it of a number; type the number in a cell formatted as one"
    if set(text) == {"#"}:
        return "stands where a spreadsheet's column was too narrow for its number: widen it and export again"
    if "_" in text and bare.replace("_", "").isdigit():
        return "is not a number: write its digits without _"
    if _THOUSANDS.fullmatch(text) and not _decimal_only(text, style):
        return 'looks like a number with thousands separators: say which with read: {thousands: "…", decimal: "…"}'
    if (value := style.number(text)) is not None and np.isinf(value):
        return "is too large for a number: correct it"
    other = Style("." if style.decimal == "," else ",")
    if is_number(text, other):
        mark = "point" if style.decimal == "," else "comma"
        return f"has a decimal {mark}, unlike the rest of the file: write all numbers one way, or set read.decimal"
    return "is not a number: correct it, or leave its row out with drop:"


def number_styles(words: Sequence[str]) -> list[tuple[dict[str, str], str]]:
    """The ways to read words with marks between groups of digits: `read` of a recipe, and the first as a number.

    >>> number_styles(["1,234.5"]), len(number_styles(["1,234"])), number_styles(["kaputt"])
    ([({'thousands': ',', 'decimal': '.'}, '1234.5')], 2, [])
    """
    if not all(_THOUSANDS.fullmatch(word) for word in words):
        return []
    styles = [Style(decimal, thousands) for decimal in ".," for thousands in GROUPS if thousands != decimal]
    found: list[tuple[dict[str, str], str]] = []
    for style in [*styles, Style(","), Style(".")]:
        values = [style.number(word) for word in words]
        if None in values or (style.thousands and not any(style.thousands in word for word in words)):
            continue
        reading = {"decimal": style.decimal} if not style.thousands else vars(style)
        shown = f"{values[0]:.12g}"
        if shown not in [other for _, other in found]:
            found.append(({k: reading[k] for k in ("thousands", "decimal") if k in reading}, shown))
    return found


def typed_number(cell: str, style: Style | None) -> str | None:
    """The number that a workbook's cell of text says, as its cells of numbers are written; None where it says none.
    style: how such cells write numbers, None where nobody has said: then of marks before three digits none is read.

    >>> typed_number("131,5", None), typed_number("1,315", None), typed_number("1.315", Style(",", "."))
    ('131.5', None, '1315')
    """
    text = cell.strip()
    if style is None and (is_number(text) and not _GROUPED.fullmatch(text)):
        style = POINTS if is_number(text, POINTS) else Style(",")
    value = None if style is None else style.number(text)
    if value is None or not np.isfinite(value):
        return None
    return text if POINTS.number(text) == value else f"{value:.15g}"


def _decimal_only(text: str, style: Style) -> bool:
    """Whether the text has one mark alone and that is the other decimal mark, with an even chance to be one."""
    marks = [c for c in text if not c.isdigit() and c not in "+-"]
    return len(marks) == 1 and marks[0] in ".," and len(text.rsplit(marks[0])[-1]) != 3


def _fast(cells: Sequence[str], style: Style) -> np.ndarray | None:
    """A column that holds plain numbers only, many times as fast; None where it does not."""
    if style != POINTS or not all(cell.isascii() and "_" not in cell for cell in cells):
        return None
    try:
        values = np.fromiter(map(float, cells), np.float64, len(cells))
    except ValueError:
        return None
    # float() also takes words: nan and infinity are told apart the slow way.
    return values if np.isfinite(values).all() else None


Row = tuple[int, list[str]]


class NoTable(UserError):
    """There are cells, but no rows of numbers under names."""


@dataclass(frozen=True)
class Grid:
    """rows: (line, cells) of every line that is neither blank nor a comment, but for one that names the columns.
    comments: the other comments, without their marks. cut_off: the file ends inside a line. texts: where cells are
    typed, those that were text."""

    name: str
    rows: list[Row]
    style: Style = POINTS
    notes: list[str] = field(default_factory=list)
    cut_off: bool = False
    comments: list[Row] = field(default_factory=list)
    texts: frozenset[str] | None = None


def few(lines: Sequence[int], most: int = 5) -> str:
    """Some of the lines in words.

    >>> few([3, 4, 9], most=2)
    '3, 4 and 1 more'
    """
    shown = ", ".join(map(str, lines[:most]))
    return f"{shown} and {len(lines) - most} more" if len(lines) > most else shown
