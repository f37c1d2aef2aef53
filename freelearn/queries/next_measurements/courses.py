"""How what is driven may go along a recording: ramps, holds and turns, every corner on a row."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from freelearn.common.formats import number
from freelearn.data.beds import Quantity, bed_of
from freelearn.data.logs import TIME
from freelearn.queries.curves.curve_rows import pressures

# Rows at rest before anything moves, as a share of a recording.
REST = 1 / 40
# Durations of a ramp over the whole range, from the fastest to one that takes nearly half of the recording.
RATES = 4
# How far up a course goes, as shares of the range.
TOPS = (1.0, 0.5)
# Levels of a staircase up, and down again.
STAIRS = 4
# Rows of a move in a course that goes up and down: faster, a row that comes a little late would miss its turn.
LEAST = 2
# Levels that a course with turns on its way goes to, one after the other.
TURNS = (1.0, 0.5, 1.0, 0.25, 0.75, 0.0)


@dataclass(frozen=True)
class Course:
    """Corners of what is driven: the number of each one's row, from zero on, and its level, a share of the range."""

    rows: tuple[int, ...]
    levels: tuple[float, ...]

    def along(self, count: int) -> np.ndarray:
        """The level of each of so many rows, (count,)."""
        return np.asarray(np.interp(np.arange(count), self.rows, self.levels))


def courses(count: int, fastest: float) -> list[Course]:
    """What a recording of `count` rows may go through. fastest: rows that the whole range takes at least."""
    rest = max(1, round(count * REST))
    slowest = max((count - rest) // 2 - 1, 1)
    within = min(1.0, slowest / fastest)
    found: dict[Course, None] = {}
    for top in TOPS:
        least = _whole(fastest * top * within)
        ramps = np.geomspace(least, max(slowest * top, least), RATES)
        for ramp in dict.fromkeys(map(_whole, ramps.tolist())):
            for moves in (_held, _back, _cycles, _hurried, _stairs, _turns):
                found[_course(moves(count - rest, ramp, least), rest, top * within, count)] = None
    return list(found)


def _whole(rows: float, least: int = 1) -> int:
    """So many whole rows at least."""
    return max(int(np.ceil(rows - 1e-9)), least)


Moves = Iterator[tuple[int, float]]


def _course(moves: Moves, rest: int, top: float, count: int) -> Course:
    """From rows that each move takes, and the level that it goes to; what does not fit is not begun."""
    rows, levels = [0, rest], [0.0, 0.0]
    for taken, level in moves:
        if rows[-1] + taken > count - 1:
            break
        if taken:
            rows.append(rows[-1] + taken)
            levels.append(level * top)
    if rows[-1] < count - 1:
        rows.append(count - 1)
        levels.append(levels[-1])
    inner = [i for i in range(1, len(rows) - 1) if not levels[i - 1] == levels[i] == levels[i + 1]]
    kept = [0, *inner, len(rows) - 1]
    return Course(tuple(rows[i] for i in kept), tuple(round(levels[i], 9) for i in kept))


# Of each: rows that are left, rows of a ramp all the way, and those of the fastest.


def _held(left: int, ramp: int, least: int) -> Moves:
    yield ramp, 1.0


def _back(left: int, ramp: int, least: int) -> Moves:
    yield from ((ramp, 1.0), (max(left // 2 - ramp, 0), 1.0), (ramp, 0.0))


def _cycles(left: int, ramp: int, least: int) -> Moves:
    ramp = max(ramp, LEAST)
    while True:
        yield from ((ramp, 1.0), (ramp, 0.0))


def _hurried(left: int, ramp: int, least: int) -> Moves:
    """Cycles, each twice as fast as the one before."""
    ramp = max(ramp, LEAST)
    while True:
        yield from ((ramp, 1.0), (ramp, 0.0))
        ramp = max(ramp // 2, least, LEAST)


def _stairs(left: int, ramp: int, least: int) -> Moves:
    each = _whole(ramp / STAIRS)
    hold = max(left // (2 * STAIRS) - each, 0)
    for level in (*range(1, STAIRS + 1), *range(STAIRS - 1, -1, -1)):
        yield from ((each, level / STAIRS), (hold, level / STAIRS))


def _turns(left: int, ramp: int, least: int) -> Moves:
    now = 0.0
    while True:
        for level in TURNS:
            yield _whole(ramp * abs(level - now), LEAST), level
            now = level


# What a course is, in words.

# Moves beyond which a path is told by their number alone.
TOLD = 8
# A distance below this share of the range is none: numbers are rounded, and a gauge flickers.
STILL = 0.005


def driven(part: pd.DataFrame) -> list[Quantity]:
    """What goes on its way in a recording; the pressure where nothing does."""
    every = [*bed_of(part).state, *pressures(part)]
    return [q for q in every if float(np.ptp(part[q.column])) > 0] or [pressures(part)[0]]


def held(part: pd.DataFrame) -> str:
    """At which pressures a recording goes in which none of them moves; empty where one does."""
    names = pressures(part)
    if any(q in driven(part) for q in names):
        return ""
    return ", ".join(f"{q.symbol} {number(float(part[q.column].iloc[0]), 3)} kPa" for q in names)


def course_in_words(part: pd.DataFrame) -> str:
    """What is done in a recording, in words."""
    time = part[TIME].to_numpy(np.float64)
    names = driven(part)
    told = [in_words(time, part[q.column].to_numpy(np.float64), q.unit) for q in names]
    at = f"at {still}: " if (still := held(part)) else ""
    if len(set(told)) == 1 and len(names) > 1:
        return f"{at}{', '.join(q.symbol for q in names)} together: {told[0]}"
    one = len(names) == 1 and len(pressures(part)) == 1
    return at + " | ".join(words if one else f"{q.symbol}: {words}" for q, words in zip(names, told, strict=True))


def in_words(time: np.ndarray, value: np.ndarray, unit: str) -> str:
    """A path of straight lines, (N,) each: where it begins, and what it does then; what comes again is told once.

    >>> in_words(np.arange(8.0), np.array([0.0, 0.0, 60.0, 60.0, 60.0, 0.0, 0.0, 0.0]), "kPa")
    'rest 1 s at 0 kPa; in 1 s to 60 kPa, hold 2 s; in 1 s to 0 kPa, hold 2 s'
    """
    corners = _corners(time, value)
    moves = list[str]()
    for i, j in itertools.pairwise(corners):
        seconds = f"{number(float(time[j] - time[i]), 2)} s"
        if abs(value[j] - value[i]) > STILL * float(np.ptp(value)):
            moves.append(f"in {seconds} to {number(float(value[j]), 3)} {unit}")
        elif moves:
            moves[-1] += f", hold {seconds}"
        else:
            moves.append(f"rest {seconds} at {number(float(value[i]), 3)} {unit}")
    if len(moves) < 2:
        return f"stay at {number(float(value[0]), 3)} {unit}"
    first = [moves.pop(0)] if moves[0].startswith("rest") else []
    period, times = _again(moves)
    if times > 1:
        return "; ".join([*first, f"{times} times: " + ", ".join(moves[:period])])
    if len(moves) > TOLD:
        moves = [*moves[: TOLD - 1], f"and {len(moves) - TOLD + 1} more such moves"]
    return "; ".join([*first, *moves])


def _corners(time: np.ndarray, value: np.ndarray) -> list[int]:
    """Rows where a straight line ends: a path is cut where it lies farthest from its chord (Douglas & Peucker 1973)."""
    near, open_, found = STILL * float(np.ptp(value)), [(0, len(value) - 1)], {0, len(value) - 1}
    while open_:
        i, j = open_.pop()
        off = np.abs(value[i : j + 1] - np.interp(time[i : j + 1], time[[i, j]], value[[i, j]]))
        k = i + int(off.argmax())
        if off[k - i] > near:
            found.add(k)
            open_ += [(i, k), (k, j)]
    return sorted(found)


def _again(moves: Sequence[str]) -> tuple[int, int]:
    """After how many moves they come again, and how often they do; the last time may be cut short."""
    for period in range(1, len(moves) // 2 + 1):
        whole = len(moves) // period * period
        if all(moves[i] == moves[i % period] for i in range(whole)):
            return period, len(moves) // period
    return len(moves), 1
