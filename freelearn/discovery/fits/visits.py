"""Visits of one place: a state each, with its own position error, or one state where that error comes again.

A carriage that runs to the same mark stands where it stood, to much less than what the mark is off by. Three visits
that are off alike are then one error of the place, and no function of it that something missing would be.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from freelearn.data.rows import Rows
from freelearn.discovery.fits.estimated_accuracy import places
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.linear_algebra import SMALLEST
from freelearn.discovery.noise.structure import f_test, winsorized

# Chance below which visits differ by more than their readings do; fewest rows of a visit that tell these, and highest
# power of the pressure that a model misses in all visits of a place alike.
DIFFERENT, FEWEST_ROWS, DEGREE = 0.01, 3, 3


def joined_visits(fit: WhiteFit, rows: Rows) -> Rows:
    """The rows, their states the places where all visits of one agree; as they are where none comes again, visits
    differ, or too few rows tell. fit: of the rows."""
    if rows.states.recording is not None:
        return rows
    # A visit is where it began: its length may creep while the pressure changes.
    _, first, visit = np.unique(rows.state, return_index=True, return_inverse=True)
    began = places(rows.states).iloc[first]
    place = began.groupby(list(began.columns[:3]), sort=False).ngroup().to_numpy()[visit]
    again = [own for own in (np.flatnonzero(place == n) for n in np.unique(place)) if len(set(rows.state[own])) > 1]
    told, chances = rows.readings.informative_mask(fit.shown).numpy(), list[float]()
    for channel in range(2):
        found = [_difference(fit, rows, own[told[own, channel]], channel) for own in again]
        between, of, within, over = np.sum([(0.0, 0.0, 0.0, 0.0), *(d for d in found if d)], axis=0)
        if of > 0 and over > 0:
            chances.append(f_test(between / of / max(within / over, SMALLEST), int(of), int(over)))
    if not chances or len(chances) * min(chances) < DIFFERENT:
        return rows
    return replace(rows, state=place, visit=rows.visits)


def _difference(fit: WhiteFit, rows: Rows, own: np.ndarray, channel: int) -> tuple[float, int, float, int] | None:
    """Of one place's rows: the square of what its visits differ by and of what is left in each, and how many degrees of
    freedom either has. What hangs on the pressure and its direction is taken off: a model misses it each time."""
    _, visit, count = np.unique(rows.state[own], return_inverse=True, return_counts=True)
    if len(count) < 2 or count.min() < FEWEST_ROWS:
        return None
    missed = fit.raw_residual[torch.as_tensor(own), channel]
    drawn_in = winsorized(missed - missed.median(), torch.ones(len(own), dtype=torch.bool)).numpy()
    pressure = rows.states.pressure.numpy()[own]
    scaled = (pressure - pressure.mean()) / max(float(np.ptp(pressure)), SMALLEST)
    alike = [scaled**n for n in range(min(DEGREE, int(count.min()) - 2) + 1)]
    common = np.stack([*alike, rows.states.direction.numpy()[own]], axis=1)
    together, rank = _left(drawn_in, common)
    apart, every = _left(drawn_in, np.concatenate([common, np.eye(len(count))[visit]], axis=1))
    return together - apart, every - rank, apart, len(own) - every


def _left(missed: np.ndarray, columns: np.ndarray) -> tuple[float, int]:
    """The square of what least squares leave, and the rank of the columns."""
    amounts, _, rank, _ = np.linalg.lstsq(columns, missed, rcond=1e-9)
    return float(np.square(missed - columns @ amounts).sum()), int(rank)
