"""Whether what a bed imposes stayed as it was, but for what its readings flicker by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from freelearn.data.beds import DEAD_LOAD, KINEMATIC

# What a bed imposes and an encoder, or a load cell, may read.
IMPOSED = tuple(quantity.column for quantity in (*KINEMATIC.state, *DEAD_LOAD.state))
# By how much a place, or a hung load, that stays may be read otherwise, as a share of the largest; twists [deg] and
# lengths [mm] at least by so much.
SHARE = 0.01
LEAST = {"twist_deg": 0.3, "elongation_mm": 0.02}
# Readings that flicker by more, so many times as much at most, are told by a gap, the next larger change being so many
# times as large; and by their changes, which turn back (of white noise by half).
WIDER, GAP, BACK = 5.0, 2.0, -0.2
# Fewest rows of a state that tell its flicker, and of all states; von Neumann's ratio, one of white noise and less than
# half of a place that creeps with the pressure, above which it is no creep.
FEWEST, ENOUGH, WHITE = 3, 12, 0.7


def stays(values: np.ndarray, column: str) -> np.ndarray:
    """Of each of values (N,) but the first, in the column's unit, whether it is the one before it: (N − 1,) bool.

    >>> stays(np.array([0.0, 0.1, -40.2, -40.0]), "twist_deg").tolist()
    [True, False, True]
    """
    same: np.ndarray = np.abs(np.diff(values)) <= _near(values, column)
    return same


def _near(values: np.ndarray, column: str, size: float = 0.0) -> float:
    """By how much one of values (N,) may be read otherwise where it stays, in the column's unit. size: as `settled`."""
    least = _least(values, column, size)
    return max(least, _noise(values, WIDER * least))


def _least(values: np.ndarray, column: str, size: float = 0.0) -> float:
    return max(SHARE * max(float(np.abs(values).max(initial=0.0)), size), LEAST.get(column, 0.0))


def _noise(values: np.ndarray, most: float) -> float:
    """The largest change that is noise, where a gap tells it from moves: 0 where none does, or it is more than `most`.

    >>> noise = np.random.default_rng(0).normal(0, 0.6, 60)
    >>> 1.0 < _noise(np.repeat([0.0, 40.0, -80.0], 20) + noise, 4.0) < 4.0
    True
    >>> _noise(np.r_[np.linspace(0, 80, 50), 0.0], 4.0)
    0.0
    >>> round(_noise(np.tile([0.0, 0.1, 0.0, 1.0, 1.1, 1.0, 8.0, 8.1], 9), 4.0), 1)
    0.1
    """
    change = np.diff(values)
    sizes = np.sort(np.abs(change[change != 0]))
    if len(sizes) < ENOUGH:
        return 0.0
    below = np.flatnonzero((sizes[1:] >= GAP * sizes[:-1]) & (sizes[:-1] <= most))
    below = below[2 * (below + 1) >= len(sizes)]
    if not len(below):
        return 0.0
    # The first such gap: beyond it, small moves may stand apart from large ones.
    size = float(sizes[below[0]])
    small = np.where(np.abs(change) <= size, change, 0.0)
    back = float((small[1:] * small[:-1]).sum()) < BACK * float((small**2).sum())
    return size if back else 0.0


def stood(table: pd.DataFrame, columns: Sequence[str]) -> np.ndarray:
    """Of each row but the first, whether it is like the one before it in these columns, what a bed imposes but for its
    flicker: (N − 1,) bool."""
    same = np.ones(max(len(table) - 1, 0), dtype=bool)
    for name in columns:
        values = table[name].to_numpy()
        imposed = name in IMPOSED and values.dtype.kind in "if"
        same &= stays(values.astype(np.float64), name) if imposed else values[1:] == values[:-1]
    return same


def settled(values: np.ndarray, state: np.ndarray, column: str, size: float = 0.0) -> np.ndarray:
    """Values (N,) of what a bed imposes, in states that it stayed in their means, where all that they differ by is what
    their readings flicker by: no row was elsewhere, and a model that is told so would miss by its stiffness.

    state: each row's number from 0, (N,). size: what counts as the largest at least, in the column's unit. A bed that
    creeps, from row to row in one direction, keeps its readings.
    """
    if len(values) < ENOUGH or not np.isfinite(values).all():
        return values
    count = np.bincount(state)
    mean = np.bincount(state, values) / np.maximum(count, 1)
    off = values - mean[state]
    most = np.zeros(len(count))
    np.maximum.at(most, state, np.abs(off))
    # A gap may be one between what a bed gives way by and where it was set.
    for near in dict.fromkeys((_near(values, column, size), _least(values, column, size))):
        held = (count >= FEWEST) & (most > 0) & (most <= near)
        asked = held[state]
        if asked.sum() >= ENOUGH and _white(off, asked, state, asked.sum() - held.sum()):
            return np.where(asked, mean[state], values)
    return values


def _white(off: np.ndarray, asked: np.ndarray, state: np.ndarray, freedom: int) -> bool:
    """Whether what rows (N,) are off their states' means by has no order, of those that are asked for, (N,) bool."""
    pairs = asked[1:] & (state[1:] == state[:-1])
    if not pairs.any():
        return False
    return bool((np.diff(off)[pairs] ** 2).mean() > WHITE * 2 * (off[asked] ** 2).sum() / freedom)


def flickers(values: np.ndarray, column: str) -> bool:
    """Whether a column (N,) holds nothing but what the readings of a place at zero flicker by: little, and no value
    like the one before it.

    >>> noise = np.random.default_rng(1).normal(0, 0.05, 200)
    >>> flickers(noise, "twist_deg"), flickers(noise.repeat(5), "twist_deg"), flickers(noise + 2, "twist_deg")
    (True, False, False)
    """
    told = values[np.isfinite(values)]
    if len(told) < ENOUGH or np.abs(told).max() > LEAST.get(column, 0.0):
        return False
    off = told - told.mean()
    return bool((np.diff(told) ** 2).mean() > WHITE * 2 * (off**2).mean() > 0)
