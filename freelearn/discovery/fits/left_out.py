"""Errors on rows left out of the fit, each part by a fit of its own."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.data.rows import Rows
from freelearn.discovery.fits.journal import Ending, ended
from freelearn.discovery.fits.white_fit import COMPARED, ONE, ROUGHLY, WhiteFit, WhiteProblem
from freelearn.discovery.noise.linear_algebra import VANISHING
from freelearn.discovery.noise.noise import Whitener
from freelearn.fitting.problem import Problem

FOLDS = 5
# Of so few kinematic states each is left out alone.
FEW_STATES = 12
# Of one state, its rows in so many runs, in the order of measuring.
RUNS = 5
# Differences in loss are drawn in to so many times their median size, and not below this much χ².
FAR, LEAST_FAR = 10.0, 4.0
# Steps of the fits without a part, and times that one of them is made shorter.
STEPS, SHORTER = 10, 5
# Damping, in units of the columns' squared lengths: what two parameters do alike is not followed.
RIDGE = 1e-9
# What the held-out errors of a search are, and are not, in a sentence.
HELDOUT_IS = (
    "Held-out errors are those of kinematic states that were left out of the fit, each part by a fit of its own; the "
    "same states chose the effects, so the errors after that are a little too low"
)


@dataclass(frozen=True)
class HeldOut:
    """Residuals of every row by a fit that did not see its fold: white and raw (N, 2); loss: sum of squares of the
    whitened ones in each group (groups,), of a single one in each fold. fold: of every row, (N,)."""

    white: Tensor
    raw: Tensor
    loss: np.ndarray
    fold: np.ndarray


def folds_of(group: np.ndarray, seed: int, count: int = FOLDS) -> np.ndarray:
    """Fold of every row, (N,): whole groups (kinematic states, samples) dealt at random into equal shares; each of few
    is a fold of its own, and one alone is cut into runs."""
    names, member = np.unique(group, return_inverse=True)
    if len(names) == 1:
        runs: np.ndarray = np.arange(len(group)) * min(RUNS, len(group)) // max(len(group), 1)
        return runs
    count = len(names) if len(names) <= FEW_STATES else count
    dealt = np.random.default_rng([seed, 101]).permutation(len(names)) % count
    folds: np.ndarray = dealt[member]
    return folds


def held_out(fit: WhiteFit, rows: Rows, whiten: Whitener, fold: np.ndarray, group: np.ndarray) -> HeldOut:
    """Residuals of each fold (N,) by a fit to the others. group: what the losses are summed over, (N,)."""
    if len(np.unique(group)) == 1:
        # Of one state its runs are what there is to compare by.
        group = fold
    raw = unseen(fit, rows, whiten, fold)
    white = whiten(raw)
    _, member = np.unique(group, return_inverse=True)
    return HeldOut(white, raw, np.bincount(member, weights=white.square().sum(-1).numpy()), fold)


def unseen(fit: WhiteFit, rows: Rows, whiten: Whitener, fold: np.ndarray) -> Tensor:
    """Residuals (N, 2) of each fold (N,) by a fit to the others."""
    numbers, part = np.unique(fold, return_inverse=True)
    vectors = left_out(fit, rows, whiten, [fold == number for number in numbers]).vectors
    # From no equilibrium that was found on the way there: resumed searches have not gone it.
    problem = Problem(fit.model, rows, ONE)
    with torch.no_grad():
        return problem.residual_by_part(vectors, torch.as_tensor(part)).reshape(len(rows), 2)


@dataclass(frozen=True)
class Refits:
    """vectors: the most probable raw parameters without each part, (parts, p). chi2: sum of the squared whitened
    residuals of the rows that stay, (parts,)."""

    vectors: Tensor
    chi2: Tensor


def left_out(fit: WhiteFit, rows: Rows, whiten: Whitener, parts: Sequence[np.ndarray]) -> Refits:
    """Refits without each of some parts of the rows, (N,) bool each.

    All in one batch, from the fit to all rows. Where a part cuts a kinematic state, the rows of it that stay keep the
    weights that they had beside the others.
    """
    problem = WhiteProblem(fit.model, rows, whiten, fit.prior, fit.near)
    stays = torch.as_tensor(~np.array(parts)).repeat_interleave(2, dim=1)
    known = 0 if fit.prior is None else len(fit.vector)
    stays = torch.cat([stays, torch.ones(len(parts), known, dtype=torch.bool)], dim=1).double()
    named = hashlib.sha256(stays.numpy().tobytes()).hexdigest()[:12]

    def sought() -> Ending:
        at, residual = _sought(problem, fit, stays)
        chi2 = residual[:, : 2 * len(rows)].square().sum(1, keepdim=True)
        return Ending(vector=torch.cat([at, chi2], dim=1).reshape(-1).tolist(), status=0, message="")

    ending = ended(f"{problem.asked(fit.vector, True)} without {named}", sought)
    both = torch.tensor(ending["vector"], dtype=torch.float64).reshape(len(parts), -1)
    return Refits(both[:, :-1], both[:, -1])


@torch.no_grad()
def _sought(problem: WhiteProblem, fit: WhiteFit, stays: Tensor) -> tuple[Tensor, Tensor]:
    """Minimizers (members, p) of ‖stays · r‖² for each row of stays (members, m), and stays · r there: Gauss–Newton
    steps from the fit, as much of them as does not raise it.

    The fit knows its derivatives, so the first step costs none. Others are taken only for members whose step showed
    that they no longer hold: most parts of the rows move the parameters by a fraction of their errors.
    """
    bounds = problem.problem.model.raw_bounds()
    white = problem.whiten(fit.raw_residual), problem.whiten(fit.raw_jacobian)
    residual, jacobian = problem.with_prior(fit.vector, *white)
    at, left = fit.vector.expand(len(stays), -1).clone(), residual * stays
    rates, active = jacobian * stays[:, :, None], torch.arange(len(stays))
    for number in range(STEPS):
        if number:
            rates = problem.jacobians(at[active]) * stays[active, :, None]
        step, promised = _gauss_newton(at[active], left[active], rates, bounds)
        going = promised > _decides(left[active])
        active, step, rates = active[going], step[going], rates[going]
        if not len(active):
            break
        tried, now, better = _shortened(problem, at[active], left[active], step, stays[active], bounds)
        linear = (rates @ (tried - at[active])[:, :, None])[:, :, 0]
        bent = now - left[active] - linear
        at[active] = torch.where(better[:, None], tried, at[active])
        left[active] = torch.where(better[:, None], now, left[active])
        # What the same derivatives promise once more, and what those along the step have come to since they were taken.
        _, again = _gauss_newton(tried, now, rates, bounds)
        turned = 2 * (bent * now).sum(1) / linear.square().sum(1).sqrt().clamp_min(VANISHING)
        active = active[better & (again + turned.square() > _decides(now))]
        if not len(active):
            break
    return at, left


def _decides(residual: Tensor) -> Tensor:
    """Reduction of χ² of residuals (members, m) that a comparison would see, (members,)."""
    return (ROUGHLY * residual.square().sum(1)).clamp_min(COMPARED)


def _gauss_newton(
    at: Tensor, residual: Tensor, jacobian: Tensor, bounds: tuple[Tensor, Tensor]
) -> tuple[Tensor, Tensor]:
    """Steps (members, p) from vectors whose residuals (members, m) have the derivatives (members, m, p), and by how
    much they would lower the sums of squares, (members,). A parameter held by its bound is none: it gives way to
    nothing."""
    length = jacobian.square().sum(1).sqrt().clamp_min(VANISHING)
    scaled, one = jacobian / length[:, None, :], torch.eye(at.shape[1], dtype=at.dtype)
    gram = scaled.mT @ scaled + RIDGE * one
    slope = (scaled.mT @ residual[:, :, None])[:, :, 0]
    held = ((at <= bounds[0]) & (slope > 0)) | ((at >= bounds[1]) & (slope < 0))
    gram = torch.where(held[:, :, None] | held[:, None, :], one, gram)
    slope = torch.where(held, 0.0, slope)
    step = -torch.linalg.solve(gram, slope[:, :, None])[:, :, 0]
    return step / length, -(slope * step).sum(1)


def _shortened(
    problem: WhiteProblem, at: Tensor, residual: Tensor, step: Tensor, stays: Tensor, bounds: tuple[Tensor, Tensor]
) -> tuple[Tensor, Tensor, Tensor]:
    """Where as much of the steps (members, p) leads as does not raise the sums of squares, the residuals there
    (members, m), and whether any of it does not, (members,)."""
    loss = residual.square().sum(1)
    share = torch.ones(len(at), 1, dtype=at.dtype)
    for _ in range(SHORTER):
        tried = (at + share * step).clamp(*bounds)
        now = problem.residuals(tried) * stays
        better = now.square().sum(1) <= loss
        if bool(better.all()):
            break
        share = torch.where(better[:, None], share, share / 4)
    return tried, now, better


def paired(better: HeldOut, other: HeldOut) -> tuple[float, float]:
    """Mean over groups of how much more loss `other` has, and its standard error."""
    return mean_of(other.loss - better.loss, LEAST_FAR)


def mean_of(differences: np.ndarray, least: float = 0.0) -> tuple[float, float]:
    """Mean of differences (groups,), and its standard error, infinite of a single one.

    Those beyond FAR times their median size are drawn in to there: one group that stands out must neither make a
    difference nor hide one. least: size that none is drawn in below.
    """
    if len(differences) < 2:
        return float(differences.mean()), float("inf")
    limit = max(FAR * float(np.median(np.abs(differences))), least)
    differences = differences.clip(-limit, limit)
    return float(differences.mean()), float(differences.std(ddof=1) / np.sqrt(len(differences)))
