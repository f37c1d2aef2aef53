"""The trust-region subproblem of nonlinear least squares, solved in the basis of a small factor.

Around a point the residuals are modeled as r + J p.  The step sought minimizes ‖r + J p‖ over ‖D p‖ ≤ Δ,
which is the least-squares solution of the stacked system [J; √λ D] p ≈ [-r; 0] for the λ ≥ 0 that meets the
radius Δ (Moré, "The Levenberg-Marquardt algorithm: implementation and theory", Lecture Notes in Mathematics
630, 1978).  The normal matrix JᵀJ is never formed: one QR factorization reduces J to R (at most p × p), and
one singular value decomposition of R D⁻¹ makes the stacked system diagonal for every λ.  The leading axis of
all arrays is `members`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import torch
from torch import Tensor

RADIUS_TOLERANCE = 1e-3
SECULAR_ITERATIONS = 100
# Rows that are factored at a time.
BLOCK_ROWS = 1024


class Basis(NamedTuple):
    """Singular values s (members, k), right vectors Vᵀ (members, k, p) and Uᵀ Qᵀ r (members, k) of R D⁻¹."""

    singular: Tensor
    right: Tensor
    projected: Tensor


class LinearModel(NamedTuple):
    """The residuals' linear model at a point, reduced by QR.

    `factor` is R (members, k, p) with k = min(m, p); `projection` is Qᵀ r (members, k); `scale` is the
    diagonal of D (members, p), positive; `free` (members, p) tells which parameters may move; `basis`
    diagonalizes the model restricted to the free parameters.
    """

    factor: Tensor
    projection: Tensor
    scale: Tensor
    free: Tensor
    basis: Basis

    def predicted_reduction(self, step: Tensor) -> Tensor:
        """‖r‖² - ‖r + J p‖² (members,) for steps p (members, p)."""
        change = apply(self.factor, step)
        return -(change * (2.0 * self.projection + change)).sum(-1)

    def slope(self, step: Tensor) -> Tensor:
        """(Jᵀ r)·p (members,), half the derivative of the loss along the step p (members, p)."""
        return (self.projection * apply(self.factor, step)).sum(-1)

    def attainable(self) -> Tensor:
        """‖r‖² - min ‖r + J p‖² (members,) over all steps of the free parameters, whatever the radius."""
        return self.basis.projected.square().sum(-1)


def apply(matrix: Tensor, vector: Tensor) -> Tensor:
    """Matrix-vector product of (members, k, p) with (members, p)."""
    return (matrix @ vector.unsqueeze(-1)).squeeze(-1)


def triangular_factor(jacobian: Tensor, residual: Tensor) -> tuple[Tensor, Tensor]:
    """R (members, k, p) and Qᵀ r (members, k), k = min(m, p), of J (members, m, p) and r (members, m).

    The residual rides along as one more column, so that Q itself is never built. A tall J is factored block by block
    and the factors' stack once more (Demmel, Grigori, Hoemmen, Langou, SIAM J. Sci. Comput. 34, 2012): as stable, and
    two to three times as fast where the blocks fit into the processor's cache.
    """
    members, rows, parameters = jacobian.shape
    # Column by column in memory, as LAPACK wants it.
    stacked = jacobian.new_empty(members, parameters + 1, rows).mT
    stacked[..., :parameters] = jacobian
    stacked[..., parameters] = residual
    size = max(BLOCK_ROWS, 4 * parameters)
    blocks = [_upper(stacked[:, i : i + size]) for i in range(0, rows, size)]
    factor = blocks[0] if len(blocks) == 1 else _upper(torch.cat(blocks, dim=-2))
    factor = factor[..., :parameters, :]
    return factor[..., :parameters], factor[..., parameters]


class Reduced(NamedTuple):
    """R (members, k, p) and Qᵀ r (members, k) of a Jacobian J and residuals r, and the norms (members, p) of J's
    columns."""

    factor: Tensor
    projection: Tensor
    columns: Tensor


def reduced(pieces: Iterable[Tensor], residual: Tensor) -> Reduced:
    """Of a J that comes in pieces (members, rows, p), one below the other, and is never whole; residual (members, m).
    NaN columns where a piece is not finite."""
    factors, squares, at = [], [], 0
    for piece in pieces:
        below = residual[:, at : at + piece.shape[1]]
        at += piece.shape[1]
        factor, projection = triangular_factor(piece, below)
        factors.append(torch.cat([factor, projection[..., None]], dim=-1))
        squares.append(piece.square().sum(-2))
    columns = torch.stack(squares).sum(0).sqrt()
    whole = torch.cat(factors, dim=-2)
    parameters = whole.shape[-1] - 1
    factor, projection = triangular_factor(whole[..., :parameters], whole[..., parameters])
    return Reduced(factor, projection, columns)


def _upper(matrix: Tensor) -> Tensor:
    """R (members, min(m, n), n) of a matrix (members, m, n)."""
    return torch.geqrf(matrix)[0][..., : matrix.shape[-1], :].triu()


def decompose(factor: Tensor, projection: Tensor, scale: Tensor, free: Tensor) -> Basis:
    """Basis of R D⁻¹ restricted to the free parameters.

    Directions whose singular value is zero to rounding are given no right-hand side: the step has no
    component in them, which makes it the shortest of all minimizers.
    """
    scaled = factor * (free / scale).unsqueeze(-2)
    left, singular, right = torch.linalg.svd(scaled, full_matrices=False)
    projected = apply(left.mT, projection)
    floor = torch.finfo(factor.dtype).eps * factor.shape[-1] * singular[..., :1]
    resolved = singular > floor
    # A one in place of a vanished singular value only keeps 0/0 out; its right-hand side is zero.
    return Basis(torch.where(resolved, singular, 1.0), right, torch.where(resolved, projected, 0.0))


def linear_model(
    factored: Reduced,
    residual: Tensor,
    norms: Tensor,
    x: Tensor,
    lower: Tensor | None,
    upper: Tensor | None,
) -> tuple[LinearModel, Tensor]:
    """Model of r (members, m) with the Jacobian J that was factored at x (members, p), and its gradient.

    `norms` are the scales D asked for (members, p), 1 taken for 0.
    A parameter is fixed when its column is zero, or when it lies on a bound and descent points out of the box.
    The gradient (members,) is the largest cosine between r and the columns of free parameters, 0 for r = 0.
    """
    factor, projection, columns = factored
    slope = apply(factor.mT, projection)
    free = columns > 0
    if lower is not None and upper is not None:
        free = free & ~((x <= lower) & (slope > 0)) & ~((x >= upper) & (slope < 0))
    size = columns * torch.linalg.vector_norm(residual, dim=-1, keepdim=True)
    cosine = torch.where(free & (size > 0), slope.abs() / size, 0.0).amax(-1)
    scale = torch.where(norms > 0, norms, 1.0)
    return LinearModel(factor, projection, scale, free, decompose(factor, projection, scale, free)), cosine


def damped_step(basis: Basis, radius: Tensor) -> Tensor:
    """Scaled step D p (members, p) of the smallest λ ≥ 0 with ‖D p‖ ≤ Δ, Δ = radius (members,), to 0.1 %.

    Newton's method runs on 1/‖D p(λ)‖ - 1/Δ, which is nearly linear in λ; from λ = 0 its iterates rise
    towards the root and never pass it, so no bracket is needed (Conn, Gould and Toint, Trust-Region Methods,
    SIAM 2000, section 7.3).
    """
    squares = basis.singular.square()
    numerator = basis.singular * basis.projected
    damping = torch.zeros_like(radius)
    denominator = squares
    component = numerator / denominator
    for _ in range(SECULAR_ITERATIONS):
        norm = torch.linalg.vector_norm(component, dim=-1)
        excess = norm / radius - 1.0
        outside = excess > RADIUS_TOLERANCE
        if not outside.any():
            break
        # The weights come first: the squares of the components may overflow, those of the weights cannot.
        weight = component / norm.clamp(min=torch.finfo(norm.dtype).tiny).unsqueeze(-1)
        increment = excess / (weight.square() / denominator).sum(-1)
        damping = torch.where(outside, damping + increment, damping)
        denominator = squares + damping.unsqueeze(-1)
        component = numerator / denominator
    return -apply(basis.right.mT, component)


def trial_point(model: LinearModel, x: Tensor, radius: Tensor, lower: Tensor | None, upper: Tensor | None) -> Tensor:
    """Point x + p (members, p) that the model proposes within the radius (members,) and the box.

    A parameter whose step would leave the box is placed on its bound, and the others are solved again with it
    fixed there, until the whole step fits.
    """
    step = torch.where(model.free, damped_step(model.basis, radius) / model.scale, 0.0)
    if lower is None or upper is None:
        return x + step
    free, pinned = model.free, torch.zeros_like(x)
    landing = x
    for _ in range(x.shape[-1]):
        target = x + step
        crossing = free & ((target < lower) | (target > upper))
        if not crossing.any():
            break
        free = free & ~crossing
        landing = torch.where(crossing, target.clamp(lower, upper), landing)
        pinned = torch.where(free, 0.0, landing - x)
        spent = torch.linalg.vector_norm(model.scale * pinned, dim=-1) / radius
        remaining = radius * (1.0 - spent.square()).clamp(min=RADIUS_TOLERANCE).sqrt()
        shifted = model.projection + apply(model.factor, pinned)
        basis = decompose(model.factor, shifted, model.scale, free)
        step = torch.where(free, damped_step(basis, remaining) / model.scale, pinned)
    # Fixed parameters take the bound itself: x + (bound - x) may miss it by a rounding error.
    return torch.where(free, (x + step).clamp(lower, upper), landing)
