"""How well a fit determines its parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.fit.problem import Problem

# Directions whose effect on the residuals is this much weaker than the strongest one's count as undetermined.
RANK_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Uncertainty:
    """values, stderr, stderr_independent: (p,), physical units; NaN where the rows do not determine a parameter.

    covariance: (p, p), the one behind `stderr`. chi_square: sum of squared residuals of n = 2·rows residuals.
    stderr allows any correlation among the rows of one kinematic state (they share a position error) and any
    size of the misfit: the cluster-robust sandwich estimate (Liang & Zeger 1986). stderr_independent is the textbook
    one, s² (JᵀJ)⁻¹, that lmfit and SciPy users know; it is right only if all residuals are independent.
    """

    names: list[str]
    values: np.ndarray
    stderr: np.ndarray
    stderr_independent: np.ndarray
    covariance: np.ndarray
    chi_square: float
    residuals: int


def uncertainty(problem: Problem) -> Uncertainty:
    """Uncertainty of a fitted model's parameters at its present values."""
    model = problem.model
    vector = model.vector().detach()
    names = model.labels()
    jacobian = problem.jacobians(vector[None])[0]
    with torch.no_grad():
        residual = problem.residual(vector)
    physical = _flat(model, vector)
    to_physical = torch.func.jacfwd(lambda v: _flat(model, v))(vector)

    # Columns scaled to length one, so that units do not decide what counts as undetermined.
    length = jacobian.norm(dim=0)
    moved = length > 0
    scaled = jacobian / torch.where(moved, length, 1.0)
    _, singular, right = torch.linalg.svd(scaled, full_matrices=False)
    strong = singular > RANK_TOLERANCE * singular.max().clamp_min(1e-300)
    inverse = torch.where(strong, 1 / torch.where(strong, singular, 1.0), 0.0)
    half = (right.T * inverse) / torch.where(moved, length, 1.0)[:, None]
    bread = half @ half.T  # (JᵀJ)⁻¹
    determined = moved & ((right[~strong] ** 2).sum(0) < 1e-6)

    freedom = max(len(residual) - int(strong.sum()), 1)
    chi_square = float(residual.square().sum())
    independent = to_physical @ (bread * (chi_square / freedom)) @ to_physical.T
    robust = to_physical @ (bread @ _meat(jacobian, residual, problem.rows.state) @ bread) @ to_physical.T

    known = ((to_physical.abs() @ (~determined).double()) == 0).numpy()

    def errors(covariance: Tensor) -> np.ndarray:
        return np.where(known, covariance.diagonal().clamp_min(0).sqrt().numpy(), np.nan)

    return Uncertainty(
        names,
        physical.numpy(),
        errors(robust),
        errors(independent),
        np.where(known[:, None] & known, robust.numpy(), np.nan),
        chi_square,
        len(residual),
    )


def _flat(model: object, vector: Tensor) -> Tensor:
    values = model.physical(vector)  # type: ignore[attr-defined]
    return torch.cat([v.reshape(-1) for v in values.values()])


def _meat(jacobian: Tensor, residual: Tensor, state: np.ndarray) -> Tensor:
    """Σ over kinematic states of the outer product of their score, (p, p), with the usual small-sample factor."""
    _, cluster = np.unique(state, return_inverse=True)
    count = int(cluster.max()) + 1
    scores = (jacobian * residual[:, None]).reshape(len(state), 2, -1).sum(1)
    total = torch.zeros(count, jacobian.shape[1], dtype=jacobian.dtype)
    total.index_add_(0, torch.as_tensor(cluster), scores)
    return total.T @ total * (count / max(count - 1, 1))
