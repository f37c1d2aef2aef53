"""Fits of whitened residuals: what every statistic of the discovery stands on."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.fit.levenberg_marquardt import LevenbergMarquardt
from freelearn.fit.problem import Problem
from freelearn.inference.noise import Whitener
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model

# Differences of the sum of squares far below one decide nothing.
TOLERANCE = 1e-7
MAX_ITERATIONS = 60
ONE = torch.ones(2, dtype=torch.float64)


@dataclass(frozen=True)
class WhiteFit:
    """A model at its whitened least-squares optimum over N rows.

    vector: raw parameters (p,). residual (N, 2) and jacobian (N, 2, p): measured − predicted is −residual, whitened.
    raw_residual (N, 2) N, N·m and raw_jacobian (N, 2, p): the same, not whitened. converged: whether the search ended
    at a minimum; message says how it ended.
    """

    model: Model
    vector: Tensor
    residual: Tensor
    jacobian: Tensor
    raw_residual: Tensor
    raw_jacobian: Tensor
    converged: bool
    message: str

    @property
    def chi2(self) -> float:
        return float(self.residual.square().sum())

    def values(self) -> dict[str, float]:
        """Physical parameters, SI."""
        with torch.no_grad():
            values = self.model.physical(self.vector)
        return {name: float(values[name]) for name in self.model.declared}


class WhiteProblem:
    """Whitened residuals of a model over rows, as functions of a raw vector; whitening stays fixed."""

    def __init__(self, model: Model, rows: Rows, whiten: Whitener) -> None:
        self.problem, self.whiten = Problem(model, rows, ONE), whiten
        self.shape = (len(rows), 2)

    def residuals(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, 2N)."""
        raw = self.problem.residuals(vectors)
        return torch.stack([self.whiten(r.reshape(self.shape)).reshape(-1) for r in raw])

    def jacobians(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, 2N, p)."""
        raw = self.problem.jacobians(vectors)
        return torch.stack([self.whiten(j.reshape(*self.shape, -1)).flatten(0, 1) for j in raw])


def white_fit(model: Model, rows: Rows, whiten: Whitener, start: Tensor) -> WhiteFit:
    """Fits from one raw start (p,); the model holds the result afterwards."""
    problem = WhiteProblem(model, rows, whiten)
    lower, upper = model.raw_bounds()
    solver = LevenbergMarquardt(
        problem.residuals,
        problem.jacobians,
        lower=lower,
        upper=upper,
        gtol=TOLERANCE,
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        max_iterations=MAX_ITERATIONS,
        batched=True,
    )
    state = solver.init(start[None])
    while state.running:
        state = solver.step(state)
    result = state.result().member(0)
    model.set_vector(result.x)
    return at(model, rows, whiten, result.x, _ended(result), state.result().message(0))


def at(
    model: Model, rows: Rows, whiten: Whitener, vector: Tensor, converged: bool = True, message: str = "not fitted"
) -> WhiteFit:
    """The residuals and derivatives of a model at a raw vector, as a fit's outcome."""
    problem = Problem(model, rows, ONE)
    shape = (len(rows), 2)
    with torch.no_grad():
        raw = problem.residual(vector).reshape(shape)
    raw_jacobian = problem.jacobians(vector[None])[0].reshape(*shape, -1)
    return WhiteFit(model, vector.clone(), whiten(raw), whiten(raw_jacobian), raw, raw_jacobian, converged, message)


def _ended(result: object) -> bool:
    from freelearn.fit.solver import Termination

    status = Termination(int(result.status))  # type: ignore[attr-defined]
    # A minimum to rounding, or so flat that sixty steps found nothing better.
    return status not in (Termination.INVALID_START, Termination.RUNNING)
