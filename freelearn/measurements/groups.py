"""Numbers of the groups that rows belong to."""

from __future__ import annotations

import numpy as np


def groups(key: np.ndarray) -> np.ndarray:
    """0, 1, … for each row's key, (N,) int64, in the order of the keys: np.unique's inverse.

    >>> groups(np.array([4, 4, 7])), groups(np.array([7, 4, 7]))
    (array([0, 0, 1]), array([1, 0, 1]))
    """
    number: np.ndarray
    # As kinematic states are numbered; sorting them takes four times the memory.
    if len(key) and bool((key[1:] >= key[:-1]).all()):
        number = np.zeros(len(key), dtype=np.int64)
        np.cumsum(key[1:] != key[:-1], out=number[1:])
        return number
    number = np.unique(key, return_inverse=True)[1]
    return number
