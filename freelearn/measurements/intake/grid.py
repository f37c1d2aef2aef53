"""A sheet of cells, as a reader of text or workbooks gives it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from freelearn.errors import UserError
from freelearn.measurements.intake.cells import POINTS, Style

Row = tuple[int, list[str]]


class NoTable(UserError):
    """There are cells, but no rows of numbers under names."""


@dataclass(frozen=True)
class Grid:
    """rows: (line, cells) of every line that is neither blank nor a comment, but for one that names the columns.
    comments: the other comments, without their marks. cut_off: the file ends inside a line."""

    name: str
    rows: list[Row]
    style: Style = POINTS
    notes: list[str] = field(default_factory=list)
    cut_off: bool = False
    comments: list[Row] = field(default_factory=list)


def few(lines: Sequence[int], most: int = 5) -> str:
    """Some of the lines in words.

    >>> few([3, 4, 9], most=2)
    '3, 4 and 1 more'
    """
    shown = ", ".join(map(str, lines[:most]))
    return f"{shown} and {len(lines) - most} more" if len(lines) > most else shown
