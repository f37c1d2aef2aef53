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
