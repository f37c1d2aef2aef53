"""How far a new measurement may lie from what a fitted model says, and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.fitting.uncertainty import quantile as student
from freelearn.queries.inverse.held_out import HeldOutRows
from freelearn.queries.inverse.raw_covariance import RawCovariance, Spread
from freelearn.queries.inverse.system import System

COVERAGE = 0.95
# Residuals beyond so many times the middling one say nothing of how the others scatter.
FAR = 4.0
# Below so many held-out rows their largest miss decides, and at least the normal distribution's quantile.
FEW, NORMAL = 40, 1.96
# With fewer recordings none of them ranks at 95 %: ⌈(K + 1) 0.95⌉ > K.
RANKED = 19
# Degrees of freedom from which Student's t is the normal distribution.
MOST_FREEDOM = 1e6
# A share of what a quantity's channel contributes below which it does not depend on it.
NO_SHARE = 1e-6


@dataclass(frozen=True)
class Miss:
    """What separates a measurement from y = f(x): parameters, measuring, and what the model does not know.

    held: rows that the fit did not see, or as if. parameters: how well these are known. accuracy: of the measuring,
    None where nobody knows it. beyond: (2, 2) covariance of what is missed besides, equal everywhere.
    """

    held: HeldOutRows
    parameters: RawCovariance
    accuracy: Accuracy | None
    beyond: Tensor

    @classmethod
    def from_held_out(cls, held: HeldOutRows, parameters: RawCovariance, accuracy: Accuracy | None) -> Miss:
        """As the held-out rows, at least one, tell it."""
        known = cls(held, parameters, accuracy, torch.zeros(2, 2, dtype=torch.float64))
        return replace(known, beyond=_beyond(held, known.own_spread.covariance, accuracy is not None))

    def spread(self, system: System, x: Tensor, slopes: Tensor, known: Tensor | None = None) -> Spread:
        """Of f(x) − y where all of x and y was measured. slopes: (N, 2, m) at x. known: (N, 2, 2), in place of what the
        parameters' uncertainty makes of f(x)."""
        total = self.beyond.expand(len(x), 2, 2).clone()
        if self.accuracy is not None:
            sensors = [getattr(self.accuracy, q.error) for q in system.bed.readings]
            total = total + torch.diag(torch.tensor(sensors, dtype=torch.float64) ** 2)
            errors = torch.tensor([getattr(self.accuracy, q.error) for q in system.inputs], dtype=torch.float64)
            spread = slopes * errors
            total = total + spread @ spread.transpose(1, 2)
        if self.parameters.silent:
            return Spread(total if known is None else total + known, torch.zeros(len(x), 2, dtype=torch.bool))
        own = self.parameters.spread(system.by_parameters(x))
        return Spread(total + (own.covariance if known is None else known), own.lost)

    @cached_property
    def own_spread(self) -> Spread:
        """Of the held-out rows, by what the fits that did not see them knew of the parameters."""
        held = self.held
        return self.spread(held.system, held.system.x, held.slopes, held.by_parameters)

    def half_width(
        self, system: System, x: Tensor, slopes: Tensor, asked: Sequence[int], given: Sequence[int], scale: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Half of the 95 % band of each input asked for (N, a), and of each output (N, 2), for a new measurement.

        The other outputs `given` were held while the inputs were found; scale (2,): what misses of outputs count in,
        where more outputs are given than inputs asked."""
        maps = answer_maps(slopes, asked, given, scale)
        deviation = _deviations(maps, self.spread(system, x, slopes))
        factor = self.factors(asked, given, scale)
        half = deviation * factor
        return half[:, : len(asked)], half[:, len(asked) :]

    def factors(self, asked: Sequence[int], given: Sequence[int], scale: Tensor) -> Tensor:
        """How many of its standard deviations hold 95 % of what was held out, of each input asked for and of each
        output: (a + 2,), NaN where nothing was measured that would tell.

        The quantile of split conformal prediction (Vovk et al. 2005; Lei et al. 2018): whatever the distribution, a new
        row drawn as these were lies within with 95 % probability."""
        held = self.held
        maps = answer_maps(held.slopes, asked, given, scale)
        missed = (maps @ held.residual[..., None])[..., 0].abs()
        deviation = _deviations(maps, self.own_spread)
        # What was measured has to be all that an answer's miss is made of.
        lacking = ~held.known
        shares = (maps @ held.slopes[:, :, :2]).abs() if held.under_load else maps.abs() * _sizes(held, scale)
        touched = (shares * lacking[:, None, :]).sum(-1) > NO_SHARE * shares.sum(-1)
        # Whether an answer's deviation is one that the misses themselves have told, in part.
        told = (((maps @ self.beyond) * maps).sum(-1) > NO_SHARE * deviation**2).any(0)
        each = []
        for i in range(maps.shape[1]):
            scores = missed[:, i] / deviation[:, i]
            there = ~touched[:, i] & scores.isfinite()
            if held.recording is not None:
                factor = among_recordings(scores[there], held.recording[there], bool(told[i]))
            elif held.state is not None:
                factor = among_states(scores[there], held.state[there])
            else:
                factor = _conformal(scores[there])
            each.append(factor)
        return torch.stack(each)


def answer_maps(slopes: Tensor, asked: Sequence[int], given: Sequence[int], scale: Tensor) -> Tensor:
    """What a miss of f(x) − y (2,) does to each input asked for, and to each output: (N, a + 2, 2)."""
    asked, given = list(asked), list(given)
    count = len(slopes)
    picked = torch.eye(2, dtype=slopes.dtype)[given]
    by_output = torch.eye(2, dtype=slopes.dtype).expand(count, 2, 2)
    if not asked:
        return by_output.clone()
    rate = slopes[:, given][:, :, asked] / scale[given][:, None]
    # Columns of like size, so that no unit decides what counts as nothing; but pressures among themselves as they are,
    # for the least of them are taken.
    size = rate.square().sum(1).sqrt()
    pressures = [k for k, i in enumerate(asked) if i >= 2]
    if pressures:
        size[:, pressures] = size[:, pressures].amax(1, keepdim=True)
    # Where a model has no derivative an answer has no band.
    told = rate.isfinite().flatten(1).all(-1)
    size = torch.where(told[:, None], size, 1.0).clamp_min(1e-300)
    rate = torch.where(told[:, None, None], rate / size[:, None, :], torch.nan)
    inverse = torch.full_like(rate.transpose(1, 2), torch.nan)
    inverse[told] = torch.linalg.pinv(rate[told], rtol=1e-10) / size[told][:, :, None]
    moved = -inverse @ (picked / scale[given][:, None])
    outputs = by_output + slopes[:, :, asked] @ moved
    return torch.cat([moved, outputs], dim=1)


def _sizes(held: HeldOutRows, scale: Tensor) -> Tensor:
    """What each output is missed by, (2,): of one that was never measured its scale, for nobody knows."""
    missed = torch.where(held.known, held.residual, 0.0).square().sum(0) / held.known.sum(0).clamp_min(1)
    return torch.where(held.known.any(0), missed.sqrt(), scale).clamp_min(1e-300)


def _deviations(maps: Tensor, spread: Spread) -> Tensor:
    """Standard deviations of what misses make of answers, maps (N, k, 2): (N, k); NaN where nobody knows."""
    variance = ((maps @ spread.covariance) * maps).sum(-1)
    lost = ((maps != 0) & spread.lost[:, None, :]).any(-1)
    return torch.where(lost, torch.nan, variance.clamp_min(0).sqrt())


def _conformal(scores: Tensor, draws: float | None = None) -> Tensor:
    """The quantile of scores (n,) that a next one stays below with 95 % probability. draws: how many of them count as
    drawn each by itself, all by default."""
    scores = scores.sort().values
    n = len(scores)
    if not n:
        return torch.tensor(torch.nan, dtype=torch.float64)
    rank = math.ceil((n + 1) * COVERAGE)
    if n < FEW or rank > n:
        return scores[-1].clamp_min(NORMAL)
    if draws is not None:
        rank = max(rank, math.ceil(n * min(math.ceil((draws + 1) * COVERAGE) / draws, 1.0)))
    return scores[rank - 1]


def among_states(scores: Tensor, state: Tensor) -> Tensor:
    """How large a score of a state that was not visited may be with 95 % probability, from scores (n,) of few states.

    The rows of a state err together, so their scores are no draws by themselves, and what is scored by is known from
    these states too: not below Student's quantile with as many degrees of freedom as states, or more where rows err by
    themselves (see among_recordings). A single state tells of itself alone."""
    square = _means(scores.square(), state)
    return _conformal(scores).clamp_min(student(_draws(square))) if len(square) > 1 else _conformal(scores)


def _draws(square: Tensor) -> float:
    """Degrees of freedom of mean squares of states or recordings, one for each at least (Satterthwaite 1946)."""
    count = len(square)
    spread = 2 * float(square.mean()) ** 2 * count / max(float(square.var()), 1e-300)
    return min(max(spread, count), MOST_FREEDOM)


def among_recordings(scores: Tensor, recording: Tensor, told: bool) -> Tensor:
    """How large a score of a further recording may be with 95 % probability, from scores (n,) each of a recording.

    What is exchangeable are recordings and not rows: these share a mounting, the parameters' error and noise that goes
    on. So the scores count as so many draws as their recordings' mean squares tell by their scatter: Satterthwaite's
    (1946) degrees of freedom, one for each recording at least, and more where rows err by themselves. Of fewer
    recordings than RANKED the quantile of all rows is about the worst one's, which another exceeds more often than in
    5 %. There a deviation that the misses themselves have `told` is known no better than these draws tell, and
    Student's t takes the normal distribution's place (JCGM 100:2008, G.4); nor do they say that less than the normal
    quantile of what is known beforehand is enough.
    """
    square = _means(scores.square(), recording)
    count = len(square)
    if count < 2:
        return _conformal(scores)
    size, draws = float(square.mean()), _draws(square)
    if count >= RANKED:
        return _conformal(scores, draws)
    return _conformal(scores).clamp_min(max(NORMAL, student(draws) * size**0.5) if told else NORMAL)


def _beyond(held: HeldOutRows, known: Tensor, accurate: bool) -> Tensor:
    """Covariance of the held-out residuals beyond what is known of them (n, 2, 2): (2, 2), never below zero.

    Residuals far from the others are drawn in. accurate: whether the measuring's accuracy is known. Then what
    recordings show beyond it has to be more than its own standard error, or every second band would be wider by what is
    above zero by chance."""
    residual = torch.where(held.known, held.residual, torch.nan) if not held.under_load else held.residual
    middling = residual.abs().nanmedian(0).values.nan_to_num(0.0) / 0.6745
    drawn = residual.clamp(-FAR * middling, FAR * middling).nan_to_num(0.0)
    pairs = drawn[:, :, None] * drawn[:, None, :]
    there = residual.isfinite()
    both = there[:, :, None] & there[:, None, :]
    count = both.sum(0).clamp_min(1)
    beyond = torch.where(both, pairs - known, 0.0)
    # In units of the middling residual, so that newtons and newton meters count alike.
    unit = torch.where(middling > 0, middling, 1.0)
    size, axes = torch.linalg.eigh(beyond.sum(0) / count / unit[:, None] / unit)
    if accurate and held.recording is not None:
        size = torch.where(size > _standard_errors(beyond / unit[:, None] / unit, axes, held.recording), size, 0.0)
    positive: Tensor = axes @ torch.diag(size.clamp_min(0)) @ axes.T
    return positive * unit[:, None] * unit


def _standard_errors(beyond: Tensor, axes: Tensor, recording: Tensor) -> Tensor:
    """Of the means of products (n, 2, 2) along two axes, as recordings scatter: (2,); none of a single recording."""
    along = torch.einsum("ia,nij,ja->na", axes, beyond, axes)
    means = _means(along, recording)
    return means.std(0) / len(means) ** 0.5 if len(means) > 1 else along.new_zeros(2)


def _means(each: Tensor, recording: Tensor) -> Tensor:
    """Of rows (n, …), each of a recording (n,), every recording's mean: (recordings, …)."""
    names, number = recording.unique(return_inverse=True)
    rows = torch.bincount(number, minlength=len(names)).reshape(-1, *[1] * (each.ndim - 1))
    return each.new_zeros(len(names), *each.shape[1:]).index_add_(0, number, each) / rows
