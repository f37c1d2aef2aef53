"""What can be wrong with the recordings of a log: each said with its line and what to do."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from freelearn.measurements.faults import Fault
from freelearn.measurements.log import RUN, TIME, is_log

# A recording with fewer samples shows nothing of what was before.
FEWEST = 8
# A step longer than the rest of its recording by this factor, and than its usual step by the other, is the clock's.
JUMP, USUAL = 3.0, 1000.0


def log_faults(table: pd.DataFrame, lines: np.ndarray, twice: bool = False) -> list[Fault]:
    """Faults of a log's recordings, of rows at these lines (N,); none of a table that is no log. twice: whether a time
    may stand there twice."""
    if not is_log(table):
        return _nameless(table, lines)
    return sorted(_faults(table, lines, twice), key=lambda fault: fault.line)


def _nameless(table: pd.DataFrame, lines: np.ndarray) -> list[Fault]:
    """Rows of a table with both columns that do not say their recording."""
    if TIME not in table or RUN not in table:
        return []
    blank = table[RUN].isna().to_numpy()
    return [Fault(int(line), RUN, "", "is blank: say of which recording the row is") for line in lines[blank]]


def _faults(table: pd.DataFrame, lines: np.ndarray, twice: bool) -> Iterator[Fault]:
    names = table[RUN].astype(str).to_numpy()
    blank = np.char.strip(names.astype(str)) == ""
    for line in lines[blank]:
        yield Fault(int(line), RUN, "", "is blank: say of which recording the row is")
    sample, time = table["sample"].to_numpy(), table[TIME].to_numpy(np.float64)
    begins = np.r_[True, (names[1:] != names[:-1]) | (sample[1:] != sample[:-1])]
    starts = np.flatnonzero(begins)
    seen: set[tuple[int, str]] = set()
    for start, end in zip(starts, np.r_[starts[1:], len(table)], strict=True):
        key = int(sample[start]), names[start]
        if key in seen:
            yield Fault(
                int(lines[start]),
                RUN,
                names[start],
                "goes on here after other rows: put each recording's rows together",
            )
            continue
        seen.add(key)
        yield from _of_one(time[start:end], lines[start:end], names[start], twice)


def _of_one(time: np.ndarray, lines: np.ndarray, name: str, may_repeat: bool) -> Iterator[Fault]:
    """Faults of one recording."""
    if len(time) < FEWEST:
        rows = "1 row" if len(time) == 1 else f"{len(time)} rows"
        yield Fault(
            int(lines[0]),
            RUN,
            name,
            f"has {rows}, too few to show what was before: delete it, or record at least {FEWEST}",
        )
        return
    step = np.diff(time)
    for at in np.flatnonzero(step < 0)[:1]:
        yield Fault(
            int(lines[at + 1]),
            TIME,
            f"{time[at + 1]:g}",
            f"runs backwards in run {name}, after {time[at]:g}: give what follows another run, or put it in order",
        )
    twice = np.flatnonzero(step == 0)
    if len(twice) and not may_repeat:
        times = "" if len(twice) == 1 else f", as do {len(twice) - 1} more in this run"
        yield Fault(
            int(lines[twice[0] + 1]),
            TIME,
            f"{time[twice[0] + 1]:g}",
            f"stands there twice in run {name}{times}: give the time with more digits, keep one row of each, or thin "
            "the log (rate_hz)",
        )
    largest = int(step.argmax())
    rest = time[-1] - time[0] - step[largest]
    if step.min() >= 0 and step[largest] > max(JUMP * rest, USUAL * float(np.median(step))):
        yield Fault(
            int(lines[largest + 1]),
            TIME,
            f"{time[largest + 1]:g}",
            f"jumps by {step[largest]:g} s in run {name}, which otherwise lasts {rest:g} s: give what follows another "
            "run, or correct the clock",
        )
