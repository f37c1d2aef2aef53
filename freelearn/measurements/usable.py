"""Which rows of a measurement table are fitted and scored."""

from __future__ import annotations

import numpy as np
import pandas as pd

# A column that a table may have: 1 where the user wants a row left out.
LEFT_OUT = "left_out"
# Another: 1 where the tube hangs loose.
SLACK = "slack"


def usable_rows(table: pd.DataFrame) -> np.ndarray:
    """Rows that may be fitted and scored, (N,) bool: neither buckled nor left out by the user.

    The others still belong to their kinematic state and to what the rubber remembers.

    >>> usable_rows(pd.DataFrame({"buckled": [0, 1, 0], "left_out": [0, 0, 1]})).tolist()
    [True, False, False]
    """
    usable: np.ndarray = (table["buckled"] == 0).to_numpy()
    if LEFT_OUT in table:
        usable = usable & (table[LEFT_OUT] == 0).to_numpy()
    return usable


def used_rows(table: pd.DataFrame) -> pd.DataFrame:
    """The table's usable rows; the table itself where all are, which on large ones saves a copy."""
    usable = usable_rows(table)
    return table if usable.all() else table[usable]


def left_out_rows(table: pd.DataFrame) -> np.ndarray:
    """Rows that only the user's mark keeps from being fitted and scored, (N,) bool: buckled ones are not counted twice.

    >>> left_out_rows(pd.DataFrame({"buckled": [0, 1, 0], "left_out": [0, 1, 1]})).tolist()
    [False, False, True]
    """
    left_out: np.ndarray = (table["buckled"] == 0).to_numpy() & ~usable_rows(table)
    return left_out
