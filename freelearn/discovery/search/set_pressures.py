"""Pressures that were set again and again, and read with an error of the gauge's own each time.

A row whose gauge read too much seems to carry too little, and one of which it read too little too much (errors in
variables: Fuller 1987). So within the rows of one level loads follow the readings less than they do from level to
level, which a threshold, a hinge or a step at just that level would explain. What all readings of a level say together
is nearer to what was there; what it errs by is common to its rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from freelearn.data.beds import KPA
from freelearn.data.levels import Levels
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Prepared, Question
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.linear_algebra import left_over
from freelearn.discovery.noise.noise import Noise
from freelearn.discovery.thresholds import GAUGES_OWN

# Levels are told where the narrowest gap between two of them is so many times the widest within one.
APART = 3.0
# No reading of a level lies so many standard deviations beside it, but where two were taken for one, or one slipped.
WIDEST = 8.0
# Readings nearer to each other than this share of the widest gap are alike.
ALIKE = 1e-9
# A smaller share of the scatter is left as the gauge read it.
LEAST_SHARE = 0.2
# Fewer levels, or rows for each, tell nothing.
FEWEST_LEVELS, FEWEST_ROWS = 3, 4


@dataclass(frozen=True)
class SetAgain:
    """Rows of levels. group: of rows of one level, sample and direction, (N,) int64; beside: by how much each row's
    reading lies above their mean, (N,) Pa; count: of their rows, (N,)."""

    group: Tensor
    beside: Tensor
    count: Tensor

    @property
    def variance(self) -> float:
        """Of readings of one level, Pa²."""
        free = float((1 - 1 / self.count).sum())
        return float(self.beside.square().sum()) / max(free, 1.0)


def set_again(rows: Rows) -> SetAgain | None:
    """None where the pressures are no such levels, or read alike."""
    states = rows.states
    if states.members or states.recording is not None:
        return None
    # A regulator may stay short of a level from one side, and one sample's of another's.
    keys = np.stack([states.direction.numpy(), states.sample.numpy()], axis=1)
    kind = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    level = _levels(states.pressure.numpy(), kind)
    if level is None:
        return None
    group = torch.as_tensor(level)
    count = torch.bincount(group).double()
    mean = torch.zeros_like(count).index_add_(0, group, states.pressure) / count
    beside = states.pressure - mean[group]
    known = SetAgain(group, beside, count[group])
    # Two levels taken for one lie farther apart than readings of one do.
    apart = float(beside.abs().max()) > WIDEST * math.sqrt(known.variance)
    return None if apart or not bool((beside != 0).any()) else known


def _levels(pressure: np.ndarray, kind: np.ndarray) -> np.ndarray | None:
    """Number of each row's level, (N,), of those of its kind: where sorted readings lie farther apart than all others
    do by a factor."""
    order = np.lexsort((pressure, kind))
    gaps, same = np.diff(pressure[order]), np.diff(kind[order]) == 0
    ranked = np.sort(gaps[same])[::-1]
    most = min(len(ranked) - 1, len(pressure) // FEWEST_ROWS)
    if most < FEWEST_LEVELS - 1:
        return None
    least = ALIKE * max(float(ranked[0]), np.finfo(float).tiny)
    ratio = ranked[:most] / np.maximum(ranked[1 : most + 1], least)
    ratio[: FEWEST_LEVELS - 2] = 0.0
    best = int(ratio.argmax())
    if ratio[best] < APART or ranked[best + 1] < least:
        return None
    level = np.empty(len(pressure), dtype=np.int64)
    level[order] = np.concatenate([[0], np.cumsum(~same | (gaps > (ranked[best] + ranked[best + 1]) / 2))])
    return level


def at_levels(prepared: Prepared, fit: WhiteFit, noise: Noise) -> Question | None:
    """What was asked, of pressures as they were set, as far as the readings are shown to differ by the gauge's own
    errors; None where they are not.

    Where the pressure was that of its level whatever the gauge read, a row is missed by all that its reading lies
    beside that; where it was what the gauge read, by nothing."""
    question = prepared.question
    known = set_again(question.rows)
    if known is None:
        return None
    beside = known.beside[torch.as_tensor(prepared.kept)]
    spanned = fit.jacobian.flatten(0, 1)
    column = noise.whitener()(noise.sensitivity[:, :, 2] * beside[:, None]).reshape(-1)
    column, left = left_over(column, spanned), left_over(fit.residual.reshape(-1), spanned)
    size = float(column.square().sum())
    if not size:
        return None
    share, error = float(column @ left) / size, math.sqrt(float(left.square().mean()) / size)
    if not share > max(GAUGES_OWN * error, LEAST_SHARE):
        return None
    share = 1.0 if share + 2 * error > 1 else share
    rows = question.rows
    levels = Levels(known.group, (share * known.variance / known.count).sqrt())
    states = rows.states.replace(pressure=rows.states.pressure - share * known.beside)
    accuracy = replace(question.accuracy, pressure=question.accuracy.pressure * math.sqrt(1 - share))
    return replace(question, rows=replace(rows, states=states, levels=levels), accuracy=accuracy)


def level_notes(rows: Rows) -> list[str]:
    """What a reader should know of pressures that were taken at their levels, in words."""
    if rows.levels is None:
        return []
    group, error = rows.levels
    scatter = float((error * torch.bincount(group)[group].sqrt()).median())
    return [
        f"readings of a pressure that was set again and again differ by the gauge's own {scatter / KPA:.2g} kPa: the "
        "search takes each for what those of its level say together"
    ]
