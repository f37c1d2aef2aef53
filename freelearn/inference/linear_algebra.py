"""Spans and least squares of tall matrices, by inner products: rows are thousands of times as many as columns."""

from __future__ import annotations

import torch
from torch import Tensor

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
