"""How a sum of squares really bends at its minimum, where large residuals bend it too."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.fitting.problem import Problem
from freelearn.fitting.uncertainty import RANK_TOLERANCE

# Steps of the differences, in standard errors of independent residuals; at least SMALLEST of it where a bound is near.
STEP, SMALLEST = 0.02, 1e-3
# Curvatures below this share of that of linear residuals are none to rely on: differences met kinks or jumps.
LEAST_CURVATURE = 0.02


def bend(problem: Problem, vector: Tensor, factor: Tensor, unit: Tensor, free: Tensor) -> Tensor:
    """½ ∂²S − JᵀJ at a minimum (p,) of the sum of squares S: what residuals times their second derivatives add, (p, p).

    In units of the raw parameters times `unit` (p,), in which `factor` (p, p) is R of J = Q R. free: (p,) bool,
    parameters that move; rows and columns of others are zero, and so is all where the differences are of no use.

    Where a model misfits its rows this is no small matter: residuals of 20 % in the loads make the continuum's sum of
    squares eight times as curved along C2/C1 as JᵀJ tells. Godambe's information needs the true curvature (White 1982).
    """
    empty = torch.zeros_like(factor)
    if not bool(free.any()):
        return empty
    _, singular, right = torch.linalg.svd(factor[:, free], full_matrices=False)
    strong = singular > RANK_TOLERANCE * singular.max().clamp_min(1e-300)
    # Along these directions, (free, k), the curvature of linear residuals is one.
    directions = right[strong].T / singular[strong]
    whole = torch.zeros(len(vector), directions.shape[1], dtype=vector.dtype)
    whole[free] = directions / unit[free, None]
    columns = []
    for direction, step in zip(whole.T, _steps(problem, vector, whole), strict=True):
        if step == 0:
            return empty
        ahead, behind = (_slope(problem, vector + sign * step * direction) for sign in (1, -1))
        columns.append(whole.T @ (ahead - behind) / (2 * step))
    curvature = torch.stack(columns, dim=1)
    curvature = (curvature + curvature.T) / 2
    if not bool(curvature.isfinite().all()) or float(torch.linalg.eigvalsh(curvature).min()) < LEAST_CURVATURE:
        return empty
    back = singular[strong, None] * right[strong]
    added = back.T @ (curvature - torch.eye(len(curvature), dtype=curvature.dtype)) @ back
    empty[free.nonzero(), free.nonzero().T] = added
    return empty


def _slope(problem: Problem, vector: Tensor) -> Tensor:
    """Jᵀr (p,), half the derivative of the sum of squares."""
    with torch.no_grad():
        residual = problem.residuals(vector[None])[0]
    return problem.jacobians(vector[None])[0].T @ residual


def _steps(problem: Problem, vector: Tensor, directions: Tensor) -> list[float]:
    """How far to go along each direction (p, k) and back; zero where a bound leaves no room."""
    lower, upper = problem.model.raw_bounds()
    with torch.no_grad():
        total = float(problem.residuals(vector[None]).square().sum())
    step = STEP * (total / max(problem.rows.readings.count - directions.shape[1], 1)) ** 0.5
    room = torch.minimum(vector - lower, upper - vector)[:, None] / directions.abs().clamp_min(1e-300)
    most = room.min(0).values.clamp_max(step)
    return [float(m) if m >= SMALLEST * step else 0.0 for m in most]
