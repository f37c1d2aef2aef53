"""Which rows of a table make up a curve."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.results.quantities import pressures
from freelearn.results.sweep import HELD, as_one, imposed, leads, moving_actuators

# Pressures move together where they are correlated like this, in rows enough to tell.
TOGETHER, ENOUGH = 0.98, 4
# Gaps between neighboring pressures, as shares of what an actuator goes through, are jitter below the first; levels are
# told apart by the first gap that is so many times the next smaller one, or else by the one that is most times it.
JITTER, CLEAR = 0.01, 4.0
# Groups of rows above this share of the longest are about as long.
LONG = 0.8
# A level wider than this share of what the actuator goes through is none; its pressures are told apart in steps.
WIDE, STEPS = 0.2, 20


def curves_of(table: pd.DataFrame, state: np.ndarray) -> np.ndarray:
    """Number of each row's curve, (N,), 0, 1, … in order of the states. state: of each row, (N,).

    A single actuator has a curve in each state. A line through rows in which several actuators of an end block change
    in turn would zigzag: there a curve has those rows of its state in which all are held but one, or but those that
    move together."""
    if len(pressures(table)) == 1:
        return state
    values = imposed(table)
    widest = np.ptp(values, axis=0).max()
    level = np.stack([levels(column, widest) for column in values.T], axis=1)
    number, count = np.zeros(len(table), dtype=np.int64), 0
    for n in np.unique(state):
        rows = np.flatnonzero(state == n)
        number[rows] = count + _curves(values[rows], level[rows])
        count = number[rows].max() + 1
    return number


def levels(pressure: np.ndarray, widest: float = 0.0) -> np.ndarray:
    """Number of the level that each of an actuator's pressures is at, (N,). widest: what the actuator of the end block
    that moves most goes through."""
    span, order = np.ptp(pressure), np.argsort(pressure, kind="stable")
    level = np.zeros(len(pressure), dtype=np.int64)
    if span <= HELD * widest:
        return level
    gaps = np.diff(pressure[order])
    sizes = np.sort(gaps[gaps > JITTER * span])
    if len(sizes):
        times = sizes / np.r_[JITTER * span, sizes[:-1]]
        least = sizes[np.argmax(times >= CLEAR) if (times >= CLEAR).any() else times.argmax()]
        level[order[1:]] = np.cumsum(gaps >= least)
    if not len(sizes) or pd.Series(pressure).groupby(level).agg(np.ptp).max() > WIDE * span:
        level = np.round((pressure - pressure.min()) / span * STEPS).astype(np.int64)
    return level


def _curves(values: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Number of the curve of each of a state's rows, (n,), in order of their first rows. values, level: (n, k)."""
    number, rest = np.zeros(len(values), dtype=np.int64), np.arange(len(values))
    while len(rest):
        group, taken = _lines(values[rest], level[rest])
        number[rest] = number.max() + 1 + group
        rest = rest[~taken]
    first, inverse = np.unique(number, return_index=True, return_inverse=True)[1:]
    ordered: np.ndarray = np.argsort(np.argsort(first))[inverse]
    return ordered


def _lines(values: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of groups of rows in which one actuator moves over levels of the others, the same actuator in all of
    them, (n,), and which rows are in such a group, (n,) bool; every row on its own level where there is none. The
    actuator: the first of the leads with a group that is about as long as any."""
    found = []
    for lead in leads(values):
        fixed = np.where(_along(values, lead), 0, level)
        group = np.unique(fixed, axis=0, return_inverse=True)[1].ravel()
        met = pd.Series(level[:, lead]).groupby(group).nunique().to_numpy()
        taken = met[group] > 1
        found.append((group, taken, np.bincount(group[taken]).max(initial=0)))
    longest = max(length for *_, length in found)
    if not longest:
        alone: np.ndarray = np.unique(level, axis=0, return_inverse=True)[1].ravel()
        return alone, np.ones(len(values), dtype=bool)
    return next((group, taken) for group, taken, length in found if length >= LONG * longest)


def _along(values: np.ndarray, lead: int) -> np.ndarray:
    """Which actuators move with this one, itself included, (k,) bool."""
    along: np.ndarray = np.arange(values.shape[1]) == lead
    if as_one(values):
        return along | True
    moves = moving_actuators(values)
    if len(values) < ENOUGH or not moves[lead]:
        return along
    for i in np.flatnonzero(moves & ~along):
        along[i] = abs(np.corrcoef(values[:, i], values[:, lead])[0, 1]) >= TOGETHER
    return along
