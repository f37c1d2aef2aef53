"""Whether a file's rows are samples of recordings, or readings that stand for themselves."""

from __future__ import annotations

import numpy as np

from freelearn.data.intake.guesses.clocks import of_one_clock, time_of
from freelearn.data.intake.guesses.guessed import Guess, Log
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.recipes.recipe import STATE
from freelearn.data.table.log_tables import FEWEST

# So many rows at least look like a log; from one sample to the next what was set moves, in the median, by no more than
# this share of its range: from one averaged reading to the next it moves by a step.
LEAST_SAMPLES, CLOSE = 50, 0.04


def log_of(raw: RawTable, found: Guess) -> Log | None:
    """What the rows would be as a log; None where they have no time, or are too few. raw: without sums."""
    several = bool(found.clocks)
    if several:
        raw, found = of_one_clock(raw, found, found.clocks[0])
    column = found.of("time_s")
    if column is None or len(raw) < FEWEST:
        return None
    time = time_of(raw, column)
    if time is None:
        return None
    time = time[np.isfinite(time)]
    falls = np.flatnonzero(np.diff(time) < 0) + 1
    shortest = int(np.diff(np.concatenate([[0], falls, [len(time)]])).min())
    # No averages at rest are written by several clocks.
    samples = len(time) >= LEAST_SAMPLES and shortest >= FEWEST and (several or _close(raw, found))
    return Log(len(falls) + 1, samples)


def _close(raw: RawTable, found: Guess) -> bool:
    """Whether nothing that was set jumps from row to row."""
    moves = []
    for column in found.columns:
        if not column.chosen or column.column not in STATE or not MEANINGS[column.quantity or ""].kind:
            continue
        values = raw.most_numbers(column.name)
        if values is not None and np.nanmax(values) > np.nanmin(values):
            steps = np.abs(np.diff(values[np.isfinite(values)]))
            moves.append(float(np.median(steps)) / float(np.nanmax(values) - np.nanmin(values)))
    return bool(moves) and max(moves) <= CLOSE
