"""Is there anything systematic left? Tests of whitened residuals that need no candidate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.inference.noise import Whitener
from freelearn.measurements.states import States

# Squared singular values (relative) below which columns of length one count as dependent.
DEPENDENT = 1e-11
# Standard deviations beyond which a residual counts as an outlier.
OUTLYING = 4.0
# Highest total degree of the polynomials in length, twist and pressure: over all samples together, of each alone.
POOLED_DEGREE, SAMPLE_DEGREE = 4, 3
# Bins of length and of twist in which a misfit of any shape may show, and half-waves over a sample's run.
BINS, WAVES = 24, 6


@dataclass(frozen=True)
class Structure:
    """p_value that residuals without structure would look as systematic as these; scale: standard deviation of
    what is left after all smooth structure is taken off, in units of the stated noise (one if that is right)."""

    p_value: float
    scale: float


def monomials(states: States, degree: int) -> tuple[Tensor, list[str]]:
    """Products of powers of length change, twist and pressure (each scaled to [−1, 1]) up to a total degree: (N, k)."""
    x = [_scaled(states.length - states.reference_length), _scaled(states.twist), _scaled(states.pressure)]
    columns, names = [], []
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            for k in range(degree + 1 - i - j):
                columns.append(x[0] ** i * x[1] ** j * x[2] ** k)
                powers = zip(("elongation", "twist", "pressure"), (i, j, k), strict=True)
                names.append(" × ".join(n if p == 1 else f"{n}^{p}" for n, p in powers if p) or "constant")
    return torch.stack(columns, dim=-1), names


def _scaled(x: Tensor) -> Tensor:
    low, high = x.min(), x.max()
    half = (high - low) / 2
    return (x - (low + high) / 2) / half if float(half) > 0 else torch.zeros_like(x)


def bases(states: States) -> list[Tensor]:
    """Generic shapes that a missing effect may leave, (N, k) each: smooth ones, uneven ones, and each sample's own."""
    rising = states.direction[:, None]
    low, _ = monomials(states, 1)
    order = torch.linspace(-1, 1, len(states), dtype=torch.float64)[:, None]
    coarse = torch.cat([monomials(states, 2)[0], rising * low, order], dim=1)
    fine = torch.cat([monomials(states, POOLED_DEGREE)[0], rising * low, order], dim=1)
    uneven = torch.cat([_binned(states.length - states.reference_length, states), _binned(states.twist, states)], dim=1)
    uneven = torch.cat([uneven, _waves(states)], dim=1)
    samples = torch.unique(states.sample)
    if len(samples) == 1:
        return [coarse, fine, uneven]
    each = torch.cat([monomials(states, SAMPLE_DEGREE)[0], rising * low, order], dim=1)
    separate = torch.cat([each * (states.sample == n)[:, None] for n in samples], dim=1)
    return [coarse, fine, uneven, separate]


def _binned(x: Tensor, states: States) -> Tensor:
    """A constant and a slope over pressure in each bin of x: what polynomials are too smooth for, (N, 2 bins)."""
    levels, level = torch.unique(x.round(decimals=9), return_inverse=True)
    if len(levels) > BINS:
        level = torch.div(level * BINS, len(levels), rounding_mode="floor")
    inside = torch.nn.functional.one_hot(level).double()
    return torch.cat([inside, inside * _scaled(states.pressure)[:, None]], dim=1)


def _waves(states: States) -> Tensor:
    """Slow waves over each sample's run, in the order of measuring: (N, WAVES × samples)."""
    columns = []
    for n in torch.unique(states.sample):
        inside = states.sample == n
        place = (torch.cumsum(inside, 0) - 0.5).double() / inside.sum()
        columns += [torch.cos(torch.pi * k * place) * inside for k in range(1, WAVES + 1)]
    return torch.stack(columns, dim=1)


def structure(residual: Tensor, jacobian: Tensor, states: States, whiten: Whitener) -> Structure:
    """Tests whitened residuals (N, 2) of a fit with whitened Jacobian (N, 2, p) for smooth structure.

    Each basis, for force and moment separately, whitened and cleared of what the fit could absorb, is regressed on
    the residuals; an F-test compares what it explains with what the finest basis leaves. The least p-value is
    multiplied by the number of bases (Bonferroni). Residuals beyond OUTLYING standard deviations are drawn in to there:
    a few rows on a kink of the model, or a few bad readings, are not a systematic misfit.
    """
    flat = winsorised(residual.reshape(-1))
    absorbed = orthonormal(jacobian.flatten(0, 1))
    spans, explained = [], []
    for basis in bases(states):
        rank, part = _explained(whitened_basis(basis, whiten), absorbed, flat)
        spans.append(rank)
        explained.append(part)
    total = float(flat.square().sum())
    finest = int(np.argmax(spans))
    freedom = len(flat) - absorbed.shape[1] - spans[finest]
    if freedom < 10:
        return Structure(1.0, float((total / max(len(flat) - absorbed.shape[1], 1)) ** 0.5))
    variance = max(total - explained[finest], 1e-300) / freedom
    from scipy.stats import f

    p_values = [f.sf(e / k / variance, k, freedom) for e, k in zip(explained, spans, strict=True) if k]
    return Structure(min(1.0, len(p_values) * min(p_values, default=1.0)), variance**0.5)


def _explained(columns: Tensor, absorbed: Tensor, flat: Tensor) -> tuple[int, float]:
    """Rank of columns (m, k) cleared of an orthonormal span (m, r), and what of |flat|² they explain.

    All from inner products: the cleared columns themselves would cost several passes over m × k numbers."""
    length = norms(columns)
    columns = columns[:, length > 0] / length[length > 0]
    if not columns.shape[1]:
        return 0, 0.0
    taken = absorbed.T @ columns
    size, axes = torch.linalg.eigh(columns.T @ columns - taken.T @ taken)
    along = axes.T @ (columns.T @ flat - taken.T @ (absorbed.T @ flat))
    kept = size > DEPENDENT
    return int(kept.sum()), float((along[kept].square() / size[kept]).sum())


def winsorised(residual: Tensor) -> Tensor:
    """Residuals drawn in to OUTLYING standard deviations, these from the median absolute value."""
    limit = OUTLYING * 1.4826 * float(residual.abs().median())
    return residual.clamp(-limit, limit) if limit > 0 else residual


def whitened_basis(basis: Tensor, whiten: Whitener) -> Tensor:
    """Basis (N, k) given to force and to moment in turn, whitened: (2N, 2k). Columns of length one before that."""
    zero = torch.zeros_like(basis)
    force, moment = whiten.variance.sqrt().mean(0)
    both = torch.cat([torch.stack([basis * force, zero], 1), torch.stack([zero, basis * moment], 1)], dim=2)
    return whiten(both).flatten(0, 1)


def orthonormal(columns: Tensor) -> Tensor:
    """Orthonormal basis of the span of columns (m, k), (m, r), by the eigenvectors of their Gram matrix.

    m is thousands of times k, so a singular value decomposition would cost many times more; what falls below the
    square root of the rounding error counts as dependent.
    """
    length = norms(columns)
    columns = columns[:, length > 0] / length[length > 0]
    if not columns.shape[1]:
        return columns
    size, axes = torch.linalg.eigh(columns.T @ columns)
    kept = size > DEPENDENT * size[-1]
    return columns @ (axes[:, kept] / size[kept].sqrt())


def norms(columns: Tensor) -> Tensor:
    """Euclidean length of each column (m, k), (k,)."""
    return columns.square().sum(0).sqrt()


def clear(columns: Tensor, span: Tensor) -> Tensor:
    """Columns (m, k) without their part in an orthonormal span (m, r); those that lie in it are left out."""
    rest = columns - span @ (span.T @ columns)
    # What only rounding left of a column must not be mistaken for a direction.
    kept = norms(rest) > 1e-6 * norms(columns)
    return rest[:, kept] - span @ (span.T @ rest[:, kept])
