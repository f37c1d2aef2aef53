"""Pressures that were set again and again, and read with an error of the gauge's own each time.

A row whose gauge read too much seems to carry too little, and one of which it read too little too much (errors in
variables: Fuller 1987). So within the rows of one level loads follow the readings less than they do from level to
level, which a threshold, a hinge or a step at just that level would explain. What all readings of a level say together
is nearer to what was there; what it errs by is common to its rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
import torch
from torch import Tensor

from freelearn.data.beds import KPA
from freelearn.data.levels import Levels
from freelearn.data.rows import Rows
from freelearn.data.states import States
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
    """Rows of levels, and k pressures. group: of rows of one level, sample and direction, (N, k) int64; beside: by how
    much each row's reading lies above their mean, (N, k) Pa; count: of their rows, (N, k)."""

    group: Tensor
    beside: Tensor
    count: Tensor

    @property
    def variance(self) -> Tensor:
        """Of readings of one level, (k,) Pa²."""
        free = (1 - 1 / self.count).sum(0).clamp_min(1.0)
        return self.beside.square().sum(0) / free


def set_again(rows: Rows) -> SetAgain | None:
    """None where no pressures are such levels, or all that are read alike."""
    states = rows.states
    if states.recording is not None:
        return None
    each = [_set_again(actuator, states.sample) for actuator in states.members or (states,)]
    if all(one is None for one in each):
        return None
    # A pressure that is set to none lies beside nothing.
    nothing = torch.zeros(len(states), 1, dtype=torch.float64)
    none = SetAgain(nothing.long(), nothing, nothing + len(states))
    columns = [one or none for one in each]
    return SetAgain(*(torch.cat([getattr(c, f.name) for c in columns], dim=1) for f in fields(SetAgain)))


def _set_again(actuator: States, sample: Tensor) -> SetAgain | None:
    """The same of one actuator's pressure."""
    # A regulator may stay short of a level from one side, and one sample's of another's.
    keys = np.stack([actuator.direction.numpy(), sample.numpy()], axis=1)
    kind = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    level = _levels(actuator.pressure.numpy(), kind)
    if level is None:
        return None
    group = torch.as_tensor(level)
    count = torch.bincount(group).double()
    mean = torch.zeros_like(count).index_add_(0, group, actuator.pressure) / count
    known = SetAgain(group[:, None], (actuator.pressure - mean[group])[:, None], count[group][:, None])
    # Two levels taken for one lie farther apart than readings of one do.
    apart = float(known.beside.abs().max()) > WIDEST * math.sqrt(float(known.variance))
    return None if apart or not bool((known.beside != 0).any()) else known


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
    column = noise.whitener()((noise.sensitivity[:, :, 2:] * beside[:, None]).sum(-1)).reshape(-1)
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
    first, second, *pressures = rows.states.inputs()
    right = [pressure - share * beside for pressure, beside in zip(pressures, known.beside.unbind(1), strict=True)]
    states = rows.states.with_inputs([first, second, *right])
    accuracy = replace(question.accuracy, pressure=question.accuracy.pressure * math.sqrt(1 - share))
    return replace(question, rows=replace(rows, states=states, levels=levels), accuracy=accuracy)


def level_notes(rows: Rows) -> list[str]:
    """What a reader should know of pressures that were taken at their levels, in words."""
    if rows.levels is None:
        return []
    scatter = max(
        float((error * torch.bincount(group)[group].sqrt()).median())
        for group, error in zip(rows.levels.group.unbind(1), rows.levels.error.unbind(1), strict=True)
    )
    return [
        f"readings of a pressure that was set again and again differ by the gauge's own {scatter / KPA:.2g} kPa: the "
        "search takes each for what those of its level say together"
    ]
