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
from freelearn.discovery.fits.white_fit import COMPARED, WhiteFit, WhiteProblem
from freelearn.discovery.noise.linear_algebra import VANISHING
from freelearn.discovery.noise.noise import Whitener

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
ONE_STATE = "There is one kinematic state: runs of its rows were left out instead, which tells nothing of other states"


@dataclass(frozen=True)
class HeldOut:
    """Residuals of every row by a fit that did not see its fold: white and raw (N, 2); loss: sum of squares of the
    whitened ones in each group (groups,), of a single one in each fold."""

    white: Tensor
    raw: Tensor
    loss: np.ndarray


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
    numbers = np.unique(fold)
    if len(np.unique(group)) == 1:
        # Of one state its runs are what there is to compare by.
        group = fold
    vectors = left_out(fit, rows, whiten, [fold == number for number in numbers])
    raw = torch.zeros_like(fit.raw_residual)
    problem = WhiteProblem(fit.model, rows, whiten)
    with torch.no_grad():
        each = problem.problem.residuals(torch.stack(vectors)).reshape(len(numbers), len(rows), 2)
    for place, number in enumerate(numbers):
        own = torch.as_tensor(fold == number)
        raw[own] = each[place][own]
    white = whiten(raw)
    _, member = np.unique(group, return_inverse=True)
    return HeldOut(white, raw, np.bincount(member, weights=white.square().sum(-1).numpy()))


def left_out(fit: WhiteFit, rows: Rows, whiten: Whitener, parts: Sequence[np.ndarray]) -> list[Tensor]:
    """Raw vectors (p,) of the most probable parameters without each of some parts of the rows, (N,) bool each.

    All in one batch, from the fit to all rows. Where a part cuts a kinematic state, the rows of it that stay keep the
    weights that they had beside the others.
    """
    problem = WhiteProblem(fit.model, rows, whiten, fit.prior, fit.near)
    stays = torch.as_tensor(~np.array(parts)).repeat_interleave(2, dim=1)
    known = 0 if fit.prior is None else len(fit.vector)
    stays = torch.cat([stays, torch.ones(len(parts), known, dtype=torch.bool)], dim=1).double()
    named = hashlib.sha256(stays.numpy().tobytes()).hexdigest()[:12]

    def sought() -> Ending:
        return Ending(vector=_sought(problem, fit.vector, stays).reshape(-1).tolist(), status=0, message="")

    ending = ended(f"{problem.asked(fit.vector, True)} without {named}", sought)
    return list(torch.tensor(ending["vector"], dtype=torch.float64).reshape(len(parts), -1))


@torch.no_grad()
def _sought(problem: WhiteProblem, start: Tensor, stays: Tensor) -> Tensor:
    """Minimizers of ‖stays · r‖² for each row of stays (members, m), from one start (p,): Gauss-Newton steps, as much
    of them as does not raise it."""
    lower, upper = problem.problem.model.raw_bounds()
    at = start.expand(len(stays), -1).clone()
    residual = problem.residuals(at) * stays
    loss = residual.square().sum(1)
    for _ in range(STEPS):
        jacobian = problem.jacobians(at) * stays[:, :, None]
        length = jacobian.square().sum(1).sqrt().clamp_min(VANISHING)
        scaled = jacobian / length[:, None, :]
        gram = scaled.mT @ scaled + RIDGE * torch.eye(len(start), dtype=start.dtype)
        slope = (scaled.mT @ residual[:, :, None])[:, :, 0]
        # A parameter held by its bound is none: it gives way to nothing.
        held = ((at <= lower) & (slope > 0)) | ((at >= upper) & (slope < 0))
        gram = torch.where(held[:, :, None] | held[:, None, :], torch.eye(len(start), dtype=start.dtype), gram)
        slope = torch.where(held, 0.0, slope)
        step = -torch.linalg.solve(gram, slope[:, :, None])[:, :, 0]
        if bool((-(slope * step).sum(1) <= COMPARED).all()):
            break
        share = torch.ones(len(at), 1, dtype=start.dtype)
        for _ in range(SHORTER):
            tried = (at + share * step / length).clamp(lower, upper)
            now = problem.residuals(tried) * stays
            better = now.square().sum(1) <= loss
            if bool(better.all()):
                break
            share = torch.where(better[:, None], share, share / 4)
        moved = better[:, None]
        at = torch.where(moved, tried, at)
        residual = torch.where(moved, now, residual)
        loss = torch.where(better, now.square().sum(1), loss)
        if not bool(better.any()):
            break
    return at


def paired(better: HeldOut, other: HeldOut) -> tuple[float, float]:
    """Mean over groups of how much more loss `other` has, and its standard error.

    Differences beyond FAR times their median size are drawn in to there: one group that stands out must neither make a
    difference nor hide one.
    """
    difference = other.loss - better.loss
    if len(difference) < 2:
        return float(difference.mean()), float("inf")
    limit = max(FAR * float(np.median(np.abs(difference))), LEAST_FAR)
    difference = difference.clip(-limit, limit)
    return float(difference.mean()), float(difference.std(ddof=1) / np.sqrt(len(difference)))
