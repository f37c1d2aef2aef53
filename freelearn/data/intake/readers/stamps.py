"""Dates with a time of day, and times of day, as seconds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, date, datetime, timedelta

import numpy as np

from freelearn.data.intake.readers.cells import is_blank

# 2026-02-25T10:00:00.125+01:00, 2026/02/25 10:00, 20260225T100000, 25.02.2026 10:00:00,5, 25-Feb-2026 10:00:00,
# 2/25/2026 10:00:00 AM, 1 day, 0:00:03, 10:00:05 and 10:00:05:250; 00:03.5 is of minutes and seconds.
_STAMP = re.compile(
    r"(?:(?P<year>\d{4})(?P<sign>[-/.])(?P<month>\d\d?)(?P=sign)(?P<day>\d\d?)[T ,_]+"
    r"|(?P<year0>\d{4})(?P<month0>\d\d)(?P<day0>\d\d)(?:[T ,_]+)"
    r"|(?P<day1>\d\d?)\.(?P<month1>\d\d?)\.(?P<year1>\d{4})[T ,]+"
    r"|(?P<day2>\d\d?)[- ](?P<month2>[A-Za-z]{3,9})[- ](?P<year2>\d{4})[T ,]+"
    r"|(?P<one>\d\d?)(?P<mark>[/-])(?P<two>\d\d?)(?P=mark)(?P<year3>\d{4})[T ,]+"
    r"|(?P<days>\d+) days?,? )?"
    r"(?:(?P<hours>\d\d?):(?P<minutes>\d\d)(?::(?P<seconds>\d\d)(?:[.,](?P<rest>\d+)|:(?P<rest2>\d{3,}))?)?"
    r"|(?P<minutes0>\d\d?):(?P<seconds0>\d\d)[.,](?P<rest0>\d+)|(?<=\d{8}.)(?P<compact>\d{6})(?:[.,](?P<rest1>\d+))?)"
    r" ?(?P<half>[AaPp]\.?[Mm]\.?)? ?(?P<zone>Z|UTC|[+-]\d\d:?\d\d)?"
)
_FIRST = date(1970, 1, 1).toordinal()
MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
# Half a day: a time of day that falls by more has passed midnight [s].
HALF_A_DAY = 43_200.0
# Rounded times of even rows stray from a line by less than this of what they are rounded to.
UNEVEN = 1.3


def seconds_of(cell: str, day_first: bool | None = None) -> float | None:
    """Seconds since 1970 (UTC where no zone stands there), of a time of day alone since midnight; None where the text
    is neither. day_first: whether 2/3/2026 is in March; None where nobody knows, and such a date is then none.

    >>> seconds_of("1970-01-02T01:00:00.5+01:00"), seconds_of("02.01.1970 00:00:00,5"), seconds_of("00:01:30")
    (86400.5, 86400.5, 90.0)
    >>> seconds_of("1/2/1970 12:00:00 AM", day_first=False), seconds_of("02-Jan-1970 00:00:01"), seconds_of("01:02.5")
    (86400.0, 86401.0, 62.5)
    """
    found = _STAMP.fullmatch(cell.strip())
    if found is None:
        return None
    part = {key: value for key, value in found.groupdict().items() if value is not None}
    days = _day(part, day_first)
    within = _of_day(part)
    return None if days is None or within is None else 86_400 * days + within


def _day(part: dict[str, str], day_first: bool | None) -> int | None:
    """Days since 1970, or as many as stand there; None for what is no day."""
    year = next((value for key, value in part.items() if key.startswith("year")), "")
    if not year:
        return int(part.get("days", 0))
    if "one" in part:
        first, second = int(part["one"]), int(part["two"])
        day_first = first > 12 if max(first, second) > 12 else day_first
        if day_first is None:
            return None
        day, month = (first, second) if day_first else (second, first)
    else:
        name = next(value for key, value in part.items() if key.startswith("month"))
        short = name[:3].lower()
        if not name.isdecimal() and short not in MONTHS:
            return None
        month = int(name) if name.isdecimal() else MONTHS.index(short) + 1
        day = int(next(value for key, value in part.items() if key.startswith("day") and key != "days"))
    try:
        return date(int(year), month, day).toordinal() - _FIRST
    except ValueError:
        return None


def _of_day(part: dict[str, str]) -> float | None:
    """Seconds since midnight, or since whatever is counted from."""
    if "hours" in part and "seconds" not in part and not any(key.startswith("year") for key in part):
        return None  # Of 02:30 alone nobody knows whether these are minutes.
    clock = part.get("compact", "")
    hours = int(clock[:2] or part.get("hours", "0"))
    minutes = int(clock[2:4] or part.get("minutes", part.get("minutes0", "0")))
    whole = int(clock[4:] or part.get("seconds", part.get("seconds0", "0")))
    if minutes > 59 or whole > 59 or ("half" in part and not 1 <= hours <= 12):
        return None
    if "half" in part:
        hours = hours % 12 + (12 if part["half"][0] in "Pp" else 0)
    if (zone := part.get("zone", "Z")) not in ("Z", "UTC"):
        minutes -= (-1 if zone[0] == "-" else 1) * (60 * int(zone[1:3]) + int(zone[-2:]))
    rest = next((value for key, value in part.items() if key.startswith("rest")), "0")
    return 60 * (60 * hours + minutes) + whole + float(f"0.{rest}")


def seconds(cells: Sequence[str], blanks: Sequence[str] = ()) -> tuple[np.ndarray, list[int]]:
    """The cells as seconds (N,), NaN where blank, and the rows that are neither. Times of day go on after midnight.
    blanks: further words for a blank."""
    values, bad = np.full(len(cells), np.nan), []
    day_first = _day_first(cells)
    for row, cell in enumerate(cells):
        if (value := seconds_of(cell, day_first)) is not None:
            values[row] = value
        elif not is_blank(cell) and cell.strip() not in blanks:
            bad.append(row)
    there = np.flatnonzero(np.isfinite(values))
    if len(there) and values[there].max() < 2 * HALF_A_DAY:
        values[there] += 2 * HALF_A_DAY * np.cumsum(np.diff(values[there], prepend=values[there[0]]) < -HALF_A_DAY)
    return values, bad


def _day_first(cells: Sequence[str]) -> bool | None:
    """Whether a column's dates such as 2/3/2026 name the day first: as one of them shows, or as they lie closer
    together, for a recording lasts hours rather than months; None where there are none, or neither tells."""
    pairs = set()
    for cell in cells:
        found = _STAMP.fullmatch(cell.strip()) if "/" in cell or "-" in cell else None
        if found is not None and found["one"]:
            pairs.add((int(found["one"]), int(found["two"]), found["year3"]))
    if any(max(first, second) > 12 for first, second, _ in pairs):
        return any(first > 12 for first, *_ in pairs)
    days = [{date(int(y), *reversed(p) if first else p) for *p, y in pairs} for first in (True, False)]
    spans = [(max(each) - min(each)).days for each in days] if pairs else [0, 0]
    return spans[0] < spans[1] if spans[0] != spans[1] or len(pairs) == 1 else None


def spread_evenly(time: np.ndarray) -> np.ndarray | None:
    """Rounded times (N,) as those of rows that were taken evenly, anew where they fall; None where no even spacing
    rounds to them.

    >>> spread_evenly(np.array([3.0, 4.0, 4.0, 5.0, 5.0, 6.0])).round(9).tolist()
    [3.0, 3.5, 4.0, 4.5, 5.0, 5.5]
    """
    spread = []
    for part in np.split(time, np.flatnonzero(np.diff(time) < 0) + 1):
        steps = np.unique(np.diff(part))
        if not len(steps) or steps[-1] <= 0:
            return None
        rounding, row = float(steps[steps > 0][0]), np.arange(len(part))
        # A row at which it changes is nearest to its stamp.
        changes = np.flatnonzero(np.diff(part)) + 1
        if len(changes) < 2:
            return None
        rate = float(np.polyfit(changes, part[changes], 1)[0])
        late = part - rate * row
        if np.ptp(late) > UNEVEN * rounding:
            return None
        spread.append(rate * row + late.max())
    made = np.concatenate(spread)
    return np.asarray(made - (made[0] - time[0]))


def moment(value: float) -> str:
    """Seconds since 1970 as a date with a time of day; those of the first days, since midnight, as that alone.

    >>> moment(1772366403.5), moment(36000.0)
    ('2026-03-01 12:00:03.5', '10:00:00')
    """
    shown = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=value)
    day = "" if value < 4 * HALF_A_DAY else f"{shown:%Y-%m-%d} "
    return f"{day}{shown:%H:%M:%S}" + (f".{shown.microsecond:06d}".rstrip("0") if shown.microsecond else "")
