"""Held-out errors over whole kinematic states or whole samples, without refitting."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.inference.linear_algebra import SMALLEST, norms
from freelearn.inference.white_fit import WhiteFit

FOLDS = 5
# Differences in loss are drawn in to so many times their median size, and not below this much χ².
FAR, LEAST_FAR = 10.0, 4.0
# What the held-out errors of a search are, and are not, in a sentence.
HELDOUT_IS = (
    "Held-out errors are cross-validated over whole kinematic states, left out of the fit by one linearized step; the "
    "same states chose the effects, so the errors after that are a little too low"
)


@dataclass(frozen=True)
class HeldOut:
    """Residuals of every row by a fit that did not see its fold: white and raw (N, 2); loss: sum of squares of the
    whitened ones in each group (groups,)."""

    white: Tensor
    raw: Tensor
    loss: np.ndarray


def folds_of(group: np.ndarray, seed: int, count: int = FOLDS) -> np.ndarray:
    """Fold of every row, (N,): whole groups (kinematic states, samples) dealt at random into equal shares."""
    names, member = np.unique(group, return_inverse=True)
    count = min(count, len(names))
    dealt = np.random.default_rng([seed, 101]).permutation(len(names)) % count
    return dealt[member]


def cross_validate(fit: WhiteFit, fold: np.ndarray, group: np.ndarray) -> HeldOut:
    """Cross-validation by one Gauss-Newton step per fold, from the fit to all rows.

    Leaving fold f out moves the optimum by δ = (JᵀJ − J_fᵀJ_f)⁻¹ J_fᵀ r_f to first order, exactly so for models linear
    in their parameters (Cook & Weisberg 1982, Section 2.2); the fold's residuals then are r_f + J_f δ.
    """
    jacobian, residual = fit.jacobian, fit.residual
    whole = jacobian.flatten(0, 1)
    scale = norms(whole).clamp_min(SMALLEST)
    normal = (whole / scale).T @ (whole / scale)
    white, raw = residual.clone(), fit.raw_residual.clone()
    for f in np.unique(fold):
        rows = torch.as_tensor(np.flatnonzero(fold == f))
        part = jacobian[rows].flatten(0, 1) / scale
        rest = normal - part.T @ part
        step = torch.linalg.pinv(rest, hermitian=True, rtol=1e-12) @ (part.T @ residual[rows].reshape(-1)) / scale
        white[rows] = residual[rows] + jacobian[rows] @ step
        raw[rows] = fit.raw_residual[rows] + fit.raw_jacobian[rows] @ step
    _, member = np.unique(group, return_inverse=True)
    loss = np.bincount(member, weights=white.square().sum(-1).numpy())
    return HeldOut(white, raw, loss)


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
