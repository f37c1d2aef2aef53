"""What a table has beyond quantities: states that its rows share, and the count of steps in them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.errors import UserError


def shared_values(values: np.ndarray, tolerance: float, column: str) -> np.ndarray:
    """Values with those that lie within the tolerance of each other replaced by their mean, (N,).

    A bed that returns to a place is not quite there. Raises UserError where values form a chain, each near the next:
    then there are no places.

    >>> shared_values(np.array([0.1, 5.0, -0.1, 5.2]), 0.5, "elongation_mm").round(2).tolist()
    [0.0, 5.1, 0.0, 5.1]
    """
    levels, place = np.unique(values, return_inverse=True)
    group = np.concatenate([[0], np.cumsum(np.diff(levels) > tolerance)])
    width = pd.Series(levels).groupby(group).agg(lambda part: part.max() - part.min())
    if (width > 2 * tolerance).any():
        wide = int(width.to_numpy().argmax())
        low, high = levels[group == wide].min(), levels[group == wide].max()
        raise UserError(
            f"state_tolerance.{column} = {tolerance:g} joins all values from {low:.4g} to {high:.4g}: choose "
            "a smaller one."
        )
    means = pd.Series(values).groupby(group[place]).transform("mean")
    return np.asarray(means.round(6))


def count_steps(table: pd.DataFrame, state: list[str]) -> np.ndarray:
    """Steps 0, 1, … of consecutive rows that are equal in the columns `state`, (N,) int64.

    >>> count_steps(pd.DataFrame({"twist_deg": [0, 0, 5, 0]}), ["twist_deg"]).tolist()
    [0, 1, 0, 0]
    """
    keys = table[state]
    new = (keys != keys.shift()).any(axis=1)
    return np.asarray(table.groupby(new.cumsum(), sort=False).cumcount(), dtype=np.int64)
