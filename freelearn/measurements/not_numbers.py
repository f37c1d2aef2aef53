"""Cells that are no numbers: what each probably is, and what to write instead."""

from __future__ import annotations

import re
import unicodedata

# What a measurement table takes for a number, without the spaces around it.
PLAIN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# Groups of digits, apart by anything that separates thousands somewhere.
_THOUSANDS = re.compile(r"[+-]?\d{1,3}([,.'’_\s]\d{3})+([.,]\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?\d*,\d+", re.ASCII)
_WORDS = ("nan", "na", "n/a", "null", "none", "inf", "infinity", "∞")
_DASHES = str.maketrans(dict.fromkeys("\u2010\u2011\u2012\u2013\u2014\u2212\ufe63\uff0d", "-"))
# Spaces and marks that are not seen within a cell.
_UNSEEN = re.compile(r"[\s\u200b-\u200f\u2060\ufeff\u00ad]")


def not_a_number(text: str) -> str:
    """What is wrong with a cell's text that is no finite number."""
    cell = text.strip()
    if not cell:
        return "is blank: write a number, or delete the line"
    if cell.lower().lstrip("+-") in _WORDS:
        return "is not a finite number: write one, or delete the line"
    if PLAIN.fullmatch(cell):
        return "is not a number: it is larger than a computer holds, so correct it"
    return _comma(cell) or f"is not a number: {_hint(cell)}"


def _comma(cell: str) -> str:
    if not _COMMA.fullmatch(cell):
        return ""
    point = cell.replace(",", ".")
    if _THOUSANDS.fullmatch(cell) and not cell.lstrip("+-").startswith("0"):
        return f"has a decimal comma or parts its thousands: write {point} or {cell.replace(',', '')}"
    return f"has a decimal comma: write {point}"


def _hint(cell: str) -> str:
    hints = (
        (cell.startswith(("=", "@")), "it is a formula, and none is calculated: save the value"),
        (PLAIN.fullmatch(cell.replace("_", "")), "write its digits without _"),
        (_THOUSANDS.fullmatch(_spaced(cell)), "write it without what parts its thousands"),
        (PLAIN.fullmatch(cell.translate(_DASHES)), "it has a dash for a minus sign: write -"),
        (PLAIN.fullmatch(_UNSEEN.sub("", cell)), "it holds spaces or marks that are not seen: type it anew"),
        (PLAIN.fullmatch(unicodedata.normalize("NFKC", cell)), "write its digits as 0 … 9"),
        (cell.startswith("#"), "it is what a spreadsheet shows instead of one: blank the cell, or delete the line"),
        (PLAIN.fullmatch(cell.rstrip("% ")), "it has a percent sign: write the quantity in the column's unit"),
    )
    return next((hint for found, hint in hints if found), "write digits with a decimal point, without a unit")


def _spaced(cell: str) -> str:
    """The cell with every kind of space as a plain one."""
    return "".join(" " if c.isspace() else c for c in cell)
