"""Spans and least squares of tall matrices, by inner products; and of a few unknowns of which some are bounded."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
import torch
from scipy.optimize import nnls
from torch import Tensor

# Spans and least squares of tall matrices, by inner products: rows are thousands of times as many as columns.

# Squared singular values (relative) below which columns of length one count as dependent.
DEPENDENT = 1e-11
# What rounding leaves of a column must not be mistaken for a direction.
ROUNDING = 1e-6
# Lengths are divided by; a column of zeros stays one.
SMALLEST = 1e-300
# A column of this length is one of zeros: its square is no number any more.
VANISHING = 1e-150


def norms(columns: Tensor) -> Tensor:
    """Euclidean length of each column (m, k), (k,).

    >>> norms(torch.tensor([[3.0, 0.0], [4.0, 2.0]]))
    tensor([5., 2.])
    """
    return columns.square().sum(0).sqrt()


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
    basis: Tensor = columns @ (axes[:, kept] / size[kept].sqrt())
    return basis


def clear(columns: Tensor, span: Tensor) -> Tensor:
    """Columns (m, k) without their part in an orthonormal span (m, r); those that lie in it are left out."""
    rest = columns - span @ (span.T @ columns)
    kept = norms(rest) > ROUNDING * norms(columns)
    return rest[:, kept] - span @ (span.T @ rest[:, kept])


def summed_products(columns: Tensor, residual: Tensor, group: Tensor, groups: int) -> Tensor:
    """Products of columns (2n, k) with residuals (2n,), summed over the rows of each group: (groups, k).

    group: number of each row's, (n,) int64; a row's two numbers stand side by side.
    """
    products = (columns * residual[:, None]).reshape(len(group), 2, -1).sum(1)
    return torch.zeros(groups, products.shape[1], dtype=products.dtype).index_add_(0, group, products)


def normal_inverse(columns: Tensor, smallest: float = 1e-12) -> Tensor:
    """(CᵀC)⁺ of columns C (m, k), (k, k), formed at column length one; `smallest`: relative eigenvalues left out.

    A column of zeros, of a parameter that has gone, gets zeros.

    >>> normal_inverse(torch.tensor([[2.0, 0.0], [0.0, 0.0]]))
    tensor([[0.2500, 0.0000],
            [0.0000, 0.0000]])
    """
    length = norms(columns)
    # Divided by twice: what rounding leaves must not grow beyond all bounds.
    length = torch.where(length > VANISHING, length, 1.0)
    scaled = columns / length
    inverse: Tensor = torch.linalg.pinv(scaled.T @ scaled, hermitian=True, rtol=smallest)
    return inverse / length / length[:, None]


def left_over(targets: Tensor, columns: Tensor) -> Tensor:
    """What least squares by columns (m, k) leave of targets, (m,) or (m, n)."""
    return targets - columns @ (normal_inverse(columns) @ (columns.T @ targets))


# Variance that is shared, in units of what is not, which changes nothing.
NOTHING_SHARED = 1e-6


class Shared(NamedTuple):
    """What else independent numbers (n,) of variance one share: of W, what each of some errors of variance one does to
    them, along (n, k) its axes and shorter (k,) by how much numbers shrink along them to be independent again.

    The covariance is I + WWᵀ, W = Q diag(w)^½ Vᵀ, and I − Q diag(1 − (1 + w)^−½) Qᵀ its inverse root."""

    along: Tensor
    shorter: Tensor

    @classmethod
    def of(cls, columns: Tensor) -> Shared:
        """columns: W, (n, errors)."""
        size, axes = torch.linalg.eigh(columns.T @ columns)
        told = size > NOTHING_SHARED
        return cls(columns @ (axes[:, told] * size[told].rsqrt()), 1 - (1 + size[told]).rsqrt())

    def apart(self, columns: Tensor) -> Tensor:
        """Numbers (n, m) made independent."""
        if not len(self.shorter):
            return columns
        return columns - self.along @ (self.shorter[:, None] * (self.along.T @ columns))


# Least squares of a few unknowns of which some may move to one side only, for many right-hand sides at once.

# More bounded unknowns have too many faces (2 to their number) to try them all.
MOST_FACES = 10
RIDGE = 1e-12


def bounded_least_squares(
    gram: np.ndarray, slopes: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Minimizers x of ‖A x − y‖² within low ≤ x ≤ high, each bound 0 or infinite, and the reductions of it from x = 0.

    gram: AᵀA (k, k), of full rank. slopes: Aᵀy, (draws, k). Returns x (draws, k) and the reductions (draws,). At the
    minimum some of the bounded unknowns are zero and the others free of their bounds, a face of the box: every face is
    solved, and the best of those whose solution respects the bounds is the minimum (Lawson & Hanson 1974, Chapter 23).

    >>> gram, slopes = np.eye(2), np.array([[3.0, -4.0]])
    >>> bounded_least_squares(gram, slopes, np.zeros(2), np.full(2, np.inf))
    (array([[3., 0.]]), array([9.]))
    """
    # An unknown that nothing depends on stays where it is; rounding may leave less than nothing of it.
    length = np.sqrt(np.maximum(np.diagonal(gram), 0.0))
    length = np.where(length > 0, length, 1.0)
    gram, slopes = gram / length / length[:, None] + RIDGE * np.eye(len(gram)), slopes / length
    # Turned round where only negative values are allowed, so that all bounds are x ≥ 0.
    side = np.where(high == 0, -1.0, 1.0)
    gram, slopes = gram * side * side[:, None], slopes * side
    bounded = (low == 0) | (high == 0)
    x = np.linalg.solve(gram, slopes.T).T
    # Where no bound is overstepped, none counts.
    beyond = (x[:, bounded] < 0).any(1)
    if beyond.any():
        solve = _faces if bounded.sum() <= MOST_FACES else _one_by_one
        x[beyond] = solve(gram, slopes[beyond], bounded)
    gain = (x * (2 * slopes - x @ gram)).sum(1)
    return x * side / length, gain


def _faces(gram: np.ndarray, slopes: np.ndarray, bounded: np.ndarray) -> np.ndarray:
    best, x = np.zeros(len(slopes)), np.zeros_like(slopes)
    for inside in product((True, False), repeat=int(bounded.sum())):
        free = ~bounded
        free[bounded] = inside
        if not free.any():
            continue
        solution = np.linalg.solve(gram[np.ix_(free, free)], slopes[:, free].T).T
        gain = (solution * slopes[:, free]).sum(1)
        allowed = (solution[:, bounded[free]] >= 0).all(1) & (gain > best)
        best[allowed] = gain[allowed]
        x[allowed] = 0.0
        x[np.ix_(allowed, free)] = solution[allowed]
    return x


def _one_by_one(gram: np.ndarray, slopes: np.ndarray, bounded: np.ndarray) -> np.ndarray:
    """The free unknowns are eliminated, the bounded ones left to Lawson and Hanson's algorithm."""
    free = ~bounded
    mixed = np.linalg.solve(gram[np.ix_(free, free)], np.c_[gram[np.ix_(free, bounded)], slopes[:, free].T])
    coupling, alone = mixed[:, : bounded.sum()], mixed[:, bounded.sum() :].T
    rest = gram[np.ix_(bounded, bounded)] - gram[np.ix_(bounded, free)] @ coupling
    upper = np.linalg.cholesky(rest).T
    targets = np.linalg.solve(upper.T, (slopes[:, bounded] - alone @ gram[np.ix_(free, bounded)]).T).T
    x = np.zeros_like(slopes)
    x[:, bounded] = [nnls(upper, target)[0] for target in targets]
    x[:, free] = alone - x[:, bounded] @ coupling.T
    return x
