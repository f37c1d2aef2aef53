"""Whether what a bed imposes stayed as it was, but for what its readings flicker by."""

from __future__ import annotations

import numpy as np

# By how much a place, or a hung load, that stays may be read otherwise, as a share of the largest; twists [deg] at
# least by so much.
SHARE = 0.01
LEAST = {"twist_deg": 0.3}


def stays(values: np.ndarray, column: str) -> np.ndarray:
    """Of each of values (N,) but the first, in the column's unit, whether it is the one before it: (N − 1,) bool.

    >>> stays(np.array([0.0, 0.1, -40.2, -40.0]), "twist_deg").tolist()
    [True, False, True]
    """
    near = max(SHARE * float(np.abs(values).max(initial=0.0)), LEAST.get(column, 0.0))
    same: np.ndarray = np.abs(np.diff(values)) <= near
    return same
