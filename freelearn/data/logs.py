"""Which tables are logs, and which of a log's rows belong together: without torch, as tables are read."""

from __future__ import annotations

import numpy as np
import pandas as pd

# The two columns that make a table a log.
TIME, RUN = "time_s", "run"
# Of one actuator's recordings some can be held out as they are from so many on; of fewer, blocks of each.
ENOUGH = 5
BLOCKS = 10


def is_log(table: pd.DataFrame) -> bool:
    """Whether the table's rows are samples of recordings: they have a time, and say of which run they are.

    >>> is_log(pd.DataFrame({"time_s": [0.0], "run": [1]})), is_log(pd.DataFrame({"time_s": [0.0]}))
    (True, False)
    """
    return TIME in table and RUN in table and not bool(table[[TIME, RUN]].isna().any(axis=None))


def run_numbers(table: pd.DataFrame) -> np.ndarray:
    """Number of each row's recording, (N,) int64, in the order of appearance: of one sample and one name of a run."""
    keys = pd.MultiIndex.from_arrays([table["sample"], table[RUN]])
    number: np.ndarray = pd.factorize(keys)[0]
    return number


def session_clock(table: pd.DataFrame) -> np.ndarray:
    """Time since the first row of each row's sample, (N,) s, of a log. Where a run's stamps begin before the run before
    it ended, its sample's runs are laid end to end: what passed between them is not told.

    >>> session_clock(pd.DataFrame({"sample": [3] * 4, "run": [1, 1, 2, 2], "time_s": [0.0, 1.0, 0.0, 1.0]})).tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    time, run, sample = table[TIME].to_numpy(np.float64), run_numbers(table), table["sample"].to_numpy()
    clock = np.empty(len(table))
    for number in np.unique(sample):
        rows = np.flatnonzero(sample == number)
        step, begins = np.diff(time[rows]), np.diff(run[rows]) != 0
        if (step[begins] <= 0).any():
            step[begins] = np.median(step[~begins]) if (~begins).any() else 0.0
        clock[rows] = np.append(0.0, step.cumsum())
    return clock


def pieces(table: pd.DataFrame) -> np.ndarray:
    """What may be held out of a log in one piece, (N,) int64: a recording, or a block of time of one where its sample
    has few."""
    run, sample = run_numbers(table), table["sample"].to_numpy()
    runs = pd.Series(run).groupby(sample).nunique()
    few = np.isin(sample, runs.index[runs < ENOUGH])
    own = pd.Series(run).groupby(run)
    block = own.cumcount().to_numpy() * BLOCKS // own.transform("size").to_numpy()
    piece: np.ndarray = np.unique(np.stack([run, np.where(few, block, 0)]), axis=1, return_inverse=True)[1]
    return piece.reshape(-1)
