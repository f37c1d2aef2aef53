"""By how much a sum of squares may rise within an interval, and how it really bends at its minimum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.fitting.problem import Problem
from freelearn.fitting.uncertainty import DETERMINED, RANK_TOLERANCE, quantile, small_sample, state_scores

# How a sum of squares really bends at its minimum, where large residuals bend it too.

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


# By how much a sum of squares may rise within an interval, where rows of one kinematic state err together.

# A raw parameter is held where it is within this share of a bound, and gone where moving it by its own size changes
# residuals by less than GONE (root mean square): a logarithm that went to −∞.
AT_BOUND = 1e-9
GONE = 1e-8


@dataclass(frozen=True)
class Allowance:
    """rise: of the sum of squares at either end of the interval. reach: how far the ends are from the estimate if the
    residuals are linear in all parameters; NaN where they do not determine this one. tangent: how the raw vector (p,)
    then moves along the profile, for each unit of place."""

    rise: float
    reach: float
    tangent: Tensor


def allowances(problem: Problem, vector: Tensor, slopes: Sequence[Tensor], freedom: int) -> list[Allowance]:
    """An allowance for each of the numbers whose derivatives (p,) by the raw vector are given, at the minimum `vector`.

    A sum of squares is −2 log likelihood only if all residuals are independent. Where they are not, a profile's rise is
    not distributed as χ²₁ but as λ χ²₁, λ = (robust variance of the number) / (curvature of its profile)⁻¹: the ratio
    of the observed to Godambe's information, for one number of interest with the others profiled out (Rotnitzky &
    Jewell 1990; Chandler & Bate 2007; Pace, Salvan & Sartori 2011). λ is estimated from the kinematic states, and the
    variance of the residuals with it, so Student's t² with the `freedom` of the normal intervals takes the place of χ²₁
    (Bates & Watts 1988, chapter 6). The rise is therefore λ t². In a linear model the interval is then value ±
    t·stderr, to the last digit; λ is the same in whatever unit or function the number is told. The curvature is the
    true one (profile_curvature), that of `uncertainty` JᵀJ: where a model misfits its rows, the two differ.

    Parameters at a bound, or gone to zero in their logarithm, do not move, so they do not count in the λ of others.
    """
    jacobian = problem.jacobians(vector[None])[0]
    with torch.no_grad():
        residual = problem.residual(vector)
    length = jacobian.norm(dim=0)
    free = ~_held(problem, vector, length) & (length > 0)
    unit = torch.where(length > 0, length, 1.0)
    scaled = jacobian / unit
    factor = torch.linalg.qr(scaled, mode="r").R
    scores = state_scores([scaled], residual, problem.rows.state)
    # At a bound the scores do not add up to zero; what they scatter is about their mean.
    scores = scores - scores.mean(0)
    added = bend(problem, vector, factor, unit, free)
    every = torch.stack(list(slopes)) / unit
    told = [_told(factor, added, scores, slope, free | (slope != 0)) for slope in every]
    # Of a number that the rows do not determine no λ is known: that of the worst other one, or the residuals' variance.
    left = max(problem.rows.readings.count - int(free.sum()), 1)
    unknown = max([ratio for ratio, _, _ in told if ratio == ratio], default=float(residual.square().sum()) / left)
    t = quantile(freedom)
    return [
        Allowance(t**2 * (ratio if ratio == ratio else unknown), t * (ratio * curve) ** 0.5, tangent / unit)
        for ratio, curve, tangent in told
    ]


def _told(factor: Tensor, added: Tensor, scores: Tensor, slope: Tensor, moving: Tensor) -> tuple[float, float, Tensor]:
    """λ of one number, the inverse of its profile's curvature, and the tangent (p,) of the profile.

    factor, added (p, p): the curvature is factorᵀ factor + added; scores: (states, p); slope: (p,). All in units in
    which the Jacobian's columns have length one. moving: (p,) bool. NaN, NaN, zeros where the rows do not determine it.
    """
    nothing = float("nan"), float("nan"), torch.zeros_like(slope)
    if not bool(moving.any()):
        return nothing
    _, singular, right = torch.linalg.svd(factor[:, moving], full_matrices=False)
    strong = singular > RANK_TOLERANCE * singular.max().clamp_min(1e-300)
    own = slope[moving]
    beyond = own - right[strong].T @ (right[strong] @ own)
    if float(beyond.norm()) > DETERMINED**0.5 * float(own.norm()):
        return nothing
    half = right[strong].T / singular[strong]
    curvature = torch.eye(half.shape[1], dtype=half.dtype) + half.T @ added[moving][:, moving] @ half
    along = half @ torch.linalg.solve(curvature, half.T @ own)
    inverse = float(along @ own)
    spread = float((scores[:, moving] @ along).square().sum()) * small_sample(len(scores), int(strong.sum()))
    if not 0 < inverse < torch.inf:
        return nothing
    tangent = torch.zeros_like(slope)
    tangent[moving] = along / inverse
    return spread / inverse, inverse, tangent


def _held(problem: Problem, vector: Tensor, length: Tensor) -> Tensor:
    """Raw parameters (p,) that do not move at a minimum: at a bound, or gone. length: of the Jacobian's columns."""
    lower, upper = problem.model.raw_bounds()
    near = AT_BOUND * vector.abs().clamp_min(1.0)
    return (vector - lower <= near) | (upper - vector <= near) | gone(problem, vector, length)


def gone(problem: Problem, vector: Tensor, length: Tensor) -> Tensor:
    """Raw parameters (p,) that change next to nothing at `vector`; length: (p,), of the Jacobian's columns there."""
    declared = problem.model.declared
    size = vector.abs().clamp_min(1.0)
    scale = torch.tensor([spec.scale or 0.0 for spec in declared.values()], dtype=vector.dtype)
    offset = len(vector) - len(declared)
    size[offset:] = size[offset:].maximum(scale)
    still: Tensor = length * size < GONE * problem.rows.readings.count**0.5
    return still & problem.model.free
