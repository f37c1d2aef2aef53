"""Is there anything systematic left? Tests of whitened residuals that need no candidate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.special import fdtrc
from torch import Tensor

from freelearn.inference.linear_algebra import DEPENDENT, SMALLEST, norms, orthonormal
from freelearn.inference.noise import Whitener
from freelearn.inference.shapes import Basis, bases, whitened_basis
from freelearn.measurements.states import States

# Standard deviations beyond which a residual counts as an outlier.
OUTLYING = 4.0
# Fewer degrees of freedom than this tell nothing of the noise.
FEWEST_FREE = 10


@dataclass(frozen=True)
class Structure:
    """p_value that residuals without structure would look as systematic as these; scale: standard deviation of
    what is left after all smooth structure is taken off, in units of the stated noise (one if that is right)."""

    p_value: float
    scale: float


def structure(residual: Tensor, jacobian: Tensor, states: States, whiten: Whitener) -> Structure:
    """Tests whitened residuals (N, 2) of a fit with whitened Jacobian (N, 2, p) for smooth structure.

    Each basis, for force and moment separately, whitened and cleared of what the fit could absorb, is regressed on
    the residuals; an F-test compares what it explains with what the finest basis leaves. The least p-value is
    multiplied by the number of bases (Bonferroni). Residuals beyond OUTLYING standard deviations are drawn in to there:
    a few rows on a kink of the model, or a few bad readings, are not a systematic misfit.
    """
    flat = winsorized(residual.reshape(-1))
    absorbed = orthonormal(jacobian.flatten(0, 1))
    spans, explained = [], []
    for basis in bases(states):
        rank, part = _explained(basis, absorbed, flat, whiten)
        spans.append(rank)
        explained.append(part)
    total = float(flat.square().sum())
    finest = int(np.argmax(spans))
    freedom = len(flat) - absorbed.shape[1] - spans[finest]
    if freedom < FEWEST_FREE:
        return Structure(1.0, float((total / max(len(flat) - absorbed.shape[1], 1)) ** 0.5))
    variance = max(total - explained[finest], SMALLEST) / freedom
    p_values = [f_test(e / k / variance, k, freedom) for e, k in zip(explained, spans, strict=True) if k]
    return Structure(min(1.0, len(p_values) * min(p_values, default=1.0)), variance**0.5)


def f_test(ratio: float, of: int, over: int) -> float:
    """Chance that Fisher's F with (of, over) degrees of freedom exceeds the ratio.

    >>> round(f_test(1.0, 10, 10), 3)
    0.5
    """
    return float(fdtrc(of, over, ratio))


def _explained(basis: Basis, absorbed: Tensor, flat: Tensor, whiten: Whitener) -> tuple[int, float]:
    """Rank of a basis cleared of an orthonormal span (2N, r), and what of |flat|² (2N,) it explains.

    All from inner products, block by block: the cleared columns themselves would cost several passes over them."""
    span, residual = absorbed.reshape(len(flat) // 2, 2, -1), flat.reshape(-1, 2)
    grams, taken, along = [], [], []
    for block in basis:
        columns = whitened_basis(block.columns, whiten.part(block.rows))
        length = norms(columns)
        columns = columns[:, length > 0] / length[length > 0]
        grams.append(columns.T @ columns)
        taken.append(span[block.rows].flatten(0, 1).T @ columns)
        along.append(columns.T @ residual[block.rows].reshape(-1))
    shared = torch.cat(taken, dim=1)
    if not shared.shape[1]:
        return 0, 0.0
    together: Tensor = torch.block_diag(*grams)
    size, axes = torch.linalg.eigh(together - shared.T @ shared)
    slope = axes.T @ (torch.cat(along) - shared.T @ (absorbed.T @ flat))
    kept = size > DEPENDENT
    return int(kept.sum()), float((slope[kept].square() / size[kept]).sum())


def winsorized(residual: Tensor) -> Tensor:
    """Residuals drawn in to OUTLYING standard deviations, these from the median absolute value."""
    limit = OUTLYING * 1.4826 * float(residual.abs().median())
    return residual.clamp(-limit, limit) if limit > 0 else residual
