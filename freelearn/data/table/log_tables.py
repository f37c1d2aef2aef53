"""What can be wrong with the recordings of a log, and logs of fewer rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.columns import INTEGERS, MARKS, Columns
from freelearn.data.logs import RUN, TIME, is_log, run_numbers
from freelearn.data.table.faults import Fault

# What can be wrong with the recordings of a log: each said with its line and what to do.

# A recording with fewer samples shows nothing of what was before.
FEWEST = 8
# A step longer than the rest of its recording by this factor, and than its usual step by the other, is the clock's.
JUMP, USUAL = 3.0, 1000.0


def log_faults(table: pd.DataFrame, lines: np.ndarray, twice: bool = False, fewest: int = FEWEST) -> list[Fault]:
    """Faults of a log's recordings, of rows at these lines (N,); none of a table that is no log. twice: whether a time
    may stand there twice. fewest: rows of a recording."""
    if not is_log(table):
        return _nameless(table, lines)
    return sorted(_faults(table, lines, twice, fewest), key=lambda fault: fault.line)


def _nameless(table: pd.DataFrame, lines: np.ndarray) -> list[Fault]:
    """Rows of a table with both columns that do not say their recording."""
    if TIME not in table or RUN not in table:
        return []
    blank = table[RUN].isna().to_numpy()
    return [Fault(int(line), RUN, "", "is blank: say of which recording the row is") for line in lines[blank]]


def _faults(table: pd.DataFrame, lines: np.ndarray, twice: bool, fewest: int) -> Iterator[Fault]:
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
        yield from _of_one(time[start:end], lines[start:end], names[start], twice, fewest)


def _of_one(time: np.ndarray, lines: np.ndarray, name: str, may_repeat: bool, fewest: int) -> Iterator[Fault]:
    """Faults of one recording."""
    if len(time) < fewest:
        rows = "1 row" if len(time) == 1 else f"{len(time)} rows"
        yield Fault(
            int(lines[0]),
            RUN,
            name,
            f"has {rows}, too few to show what was before: delete it, or record at least {fewest}",
        )
        return
    step = np.diff(time)
    if not len(step):
        return
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
    if (largest := jump(step)) is not None:
        rest = time[-1] - time[0] - step[largest]
        yield Fault(
            int(lines[largest + 1]),
            TIME,
            f"{time[largest + 1]:g}",
            f"jumps by {step[largest]:g} s in run {name}, which otherwise lasts {rest:g} s: give what follows another "
            "run, or correct the clock",
        )


def jump(step: np.ndarray) -> int | None:
    """The place of a clock's jump among the steps of its time (n,) [s], none of them negative; None without one."""
    largest = int(step.argmax())
    rest = step.sum() - step[largest]
    jumps = step.min() >= 0 and step[largest] > max(JUMP * rest, USUAL * float(np.median(step)))
    return largest if jumps else None


# Logs of fewer rows: a recording at 500 Hz through a low-pass, so that nothing faster stands for something slower.

# The low-pass begins at this share of half the new rate, with so many coefficients for each new row.
CORNER, TAPS = 0.8, 8
# Recordings that are no faster than the asked rate by this factor stay as they are.
NO_FASTER = 1.5


def thinned(table: pd.DataFrame, rate_hz: float) -> tuple[pd.DataFrame, np.ndarray, list[str]]:
    """A log at no more than `rate_hz` rows a second; the row in the table (n,) nearest to each; what was done, in
    words.

    Readings and what was imposed go through a low-pass without delay (a symmetric FIR filter, forth and back). Rows
    with one time are one, their mean. A reading stays blank where the nearest one is farther than half a new row, and
    no row stands in a gap. A mark stands where any of the rows that a new one replaces has it; what else there is comes
    from the nearest. Raises UserError for a table that is no log, and for a rate that is none.
    """
    if not is_log(table):
        raise UserError(f"rate_hz is for logs: give the table the columns {TIME} and {RUN}, or leave rate_hz out.")
    if not 0 < rate_hz < np.inf:
        raise UserError(f"rate_hz = {rate_hz:g} is no rate: give rows a second, for example 10.")
    run = run_numbers(table)
    parts, places, lost, rates, faster = [], [], [], [], 0
    signals = _signals(table)
    for number in range(run.max() + 1):
        own = np.flatnonzero(run == number)
        time = table[TIME].to_numpy(np.float64)[own]
        step = float(np.median(np.diff(np.unique(time)))) if len(np.unique(time)) > 1 else 0.0
        if not step or 1 / step < NO_FASTER * rate_hz:
            parts.append(table.iloc[own])
            places.append(own)
            continue
        faster += 1
        rates.append(1 / step)
        part, nearest, gone = _one(table.iloc[own], time, signals, step, 1 / rate_hz)
        parts.append(part)
        places.append(own[nearest])
        lost.append(gone)
    if not faster:
        return table, np.arange(len(table)), []
    made = pd.concat(parts, ignore_index=True).astype({n: np.int64 for n in INTEGERS if n in table})
    gone = np.sqrt(np.nanmean(np.square(lost), axis=0))
    told = ", ".join(f"{size:.2g} of {name}" for name, size in zip(signals, gone, strict=True) if size > 0)
    words = (
        f"{faster} recordings at {np.median(rates):.4g} Hz were thinned to {rate_hz:g} Hz by a low-pass at "
        f"{CORNER * rate_hz / 2:g} Hz: {len(table)} rows became {len(made)}; what was faster is gone (rms {told or 0})."
    )
    return made, np.concatenate(places), [words]


def _signals(table: pd.DataFrame) -> list[str]:
    """Columns that are filtered: what is imposed, and what is measured."""
    columns = Columns.from_table(table)
    names = (*columns.imposed, *columns.measured, "temperature_c")
    return [name for name in dict.fromkeys(names) if name in table]


def _one(
    part: pd.DataFrame, time: np.ndarray, signals: Sequence[str], step: float, new_step: float
) -> tuple[pd.DataFrame, np.ndarray, list[float]]:
    """One recording: its new rows, the old one (m,) nearest to each, and the rms of what was filtered out by signal."""
    grid = np.arange(time[0], time[-1] + step / 2, new_step)
    nearest = np.abs(time[_beside(time, grid)] - grid[:, None]).argmin(1)
    nearest = _beside(time, grid)[np.arange(len(grid)), nearest]
    # Nothing stands in a gap.
    there = np.abs(time[nearest] - grid) <= new_step / 2
    grid, nearest = grid[there], nearest[there]
    made = part.iloc[nearest].assign(**{TIME: grid})
    gone = []
    for name in signals:
        value = part[name].to_numpy(np.float64)
        known = np.isfinite(value)
        if known.sum() < 2:
            gone.append(0.0)
            continue
        at, mean = averaged(time[known], value[known])
        even, smooth, lost = smoothed(at, mean, step, new_step, (time[0], time[-1]))
        gone.append(lost)
        made[name] = _told(np.interp(grid, even, smooth), at, grid, new_step)
    owner = np.abs(grid[_beside(grid, time)] - time[:, None]).argmin(1)
    owner = _beside(grid, time)[np.arange(len(time)), owner]
    for name in (name for name in MARKS if name in part):
        marked = np.zeros(len(grid), dtype=np.int64)
        np.maximum.at(marked, owner, (part[name].to_numpy(np.float64) == 1).astype(np.int64))
        made[name] = marked
    made["step"] = np.arange(len(grid))
    return made, nearest, gone


def smoothed(
    at: np.ndarray, value: np.ndarray, step: float, new_step: float, span: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray, float]:
    """A channel (n,) read at the rising times `at` every `step` or so, through the low-pass for rows every `new_step`
    [s]: even times over the span, the values there, and the rms of what was filtered out."""
    # Not above: SciPy's signals take half a second to import.
    from scipy.signal import firwin, oaconvolve

    even = np.arange(span[0], span[1] + step / 2, step)
    line = np.interp(even, at, value)
    if line.min() == line.max():
        # Rounding is no change.
        return even, line, 0.0
    taps = firwin(TAPS * max(round(new_step / step), 1) + 1, CORNER / (2 * new_step), fs=1 / step)
    kernel = np.convolve(taps, taps)
    # Turned over about its ends, so that it goes on there as it was.
    wide = np.pad(line, len(kernel) // 2, mode="reflect", reflect_type="odd")
    smooth = oaconvolve(wide, kernel, mode="valid")
    return even, smooth, float(np.sqrt(np.mean((line - smooth) ** 2)))


def _told(value: np.ndarray, at: np.ndarray, grid: np.ndarray, step: float) -> np.ndarray:
    """Values (m,) of the new rows, NaN where no reading is near."""
    near = np.abs(at[_beside(at, grid)] - grid[:, None]).min(1) <= step / 2
    return np.where(near, value, np.nan)


def _beside(time: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Places in a rising time of the rows before and after each asked one, (n, 2)."""
    after = np.searchsorted(time, asked).clip(0, len(time) - 1)
    return np.stack([(after - 1).clip(0), after], axis=1)


def averaged(time: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each time once, with the mean of its values."""
    once, place, count = np.unique(time, return_inverse=True, return_counts=True)
    return once, np.bincount(place, weights=value) / count
