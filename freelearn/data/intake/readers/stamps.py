"""Dates with a time of day, and times of day, as seconds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, date, datetime, timedelta

import numpy as np

from freelearn.data.intake.readers.cells import is_blank

# 2026-02-25T10:00:00.125+01:00, 25.02.2026 10:00:00,5 and 10:00:05. Of 2/3/2026 nobody knows the month.
_STAMP = re.compile(
    r"(?:(?P<year>\d{4})-(?P<month>\d\d?)-(?P<day>\d\d?)[T ,]+|(?P<d>\d\d?)\.(?P<m>\d\d?)\.(?P<y>\d{4})[T ,]+)?"
    r"(?P<hours>\d\d?):(?P<minutes>\d\d)(?::(?P<seconds>\d\d)(?:[.,](?P<rest>\d+))?)?"
    r" ?(?P<zone>Z|[+-]\d\d:?\d\d)?"
)
_FIRST = date(1970, 1, 1).toordinal()


def seconds_of(cell: str) -> float | None:
    """Seconds since 1970 (UTC where no zone stands there), of a time of day alone since midnight; None where the text
    is neither.

    >>> seconds_of("1970-01-02T01:00:00.5+01:00"), seconds_of("02.01.1970 00:00:00,5"), seconds_of("00:01:30")
    (86400.5, 86400.5, 90.0)
    """
    found = _STAMP.fullmatch(cell.strip())
    if found is None:
        return None
    part = found.groupdict()
    days = 0
    if year := part["year"] or part["y"]:
        try:
            days = date(int(year), int(part["month"] or part["m"]), int(part["day"] or part["d"])).toordinal() - _FIRST
        except ValueError:
            return None
    zone = 0
    if (written := part["zone"]) and written != "Z":
        zone = (-1 if written[0] == "-" else 1) * (60 * int(written[1:3]) + int(written[-2:]))
    whole = 60 * (60 * (24 * days + int(part["hours"])) + int(part["minutes"]) - zone) + int(part["seconds"] or 0)
    return whole + float(f"0.{part['rest'] or 0}")


def seconds(cells: Sequence[str], blanks: Sequence[str] = ()) -> tuple[np.ndarray, list[int]]:
    """The cells as seconds (N,), NaN where blank, and the rows that are neither. blanks: further words for it."""
    values, bad = np.full(len(cells), np.nan), []
    for row, cell in enumerate(cells):
        if (value := seconds_of(cell)) is not None:
            values[row] = value
        elif not is_blank(cell) and cell.strip() not in blanks:
            bad.append(row)
    return values, bad


def moment(value: float) -> str:
    """Seconds since 1970 as a date with a time of day.

    >>> moment(86400.5)
    '1970-01-02 00:00:00.5'
    """
    shown = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=value)
    return f"{shown:%Y-%m-%d %H:%M:%S}" + (f".{shown.microsecond:06d}".rstrip("0") if shown.microsecond else "")
