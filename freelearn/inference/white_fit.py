"""Fits of whitened residuals: what every statistic of the discovery stands on."""

from __future__ import annotations

import hashlib
from copy import deepcopy
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.fit.levenberg_marquardt import LevenbergMarquardt
from freelearn.fit.problem import Problem
from freelearn.fit.solver import State, Termination
from freelearn.inference.journal import Ending, ended
from freelearn.inference.linear_algebra import norms, orthonormal
from freelearn.inference.noise import Whitener
from freelearn.inference.thresholds import BEHIND, PROMISE, TRUST
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model

# Relative differences of the sum of squares, and steps, that a fit does not pursue.
TOLERANCE = 1e-7
# Reduction of χ² that a fit does not pursue, in units of χ² per number: it moves a parameter by 0.001 σ.
SETTLED = 1e-6
# χ² per number beyond which a model is so wrong that a share of it decides nothing: its fit need not be pursued.
HOPELESS, ROUGHLY = 8.0, 1e-5
# A parameter has gone if a change of its raw value by one changes the residuals by less than this share of them.
GONE = 1e-4
MAX_ITERATIONS = 60
ONE = torch.ones(2, dtype=torch.float64)


@dataclass(frozen=True)
class WhiteFit:
    """A model at its whitened least-squares optimum over N rows.

    vector: raw parameters (p,). residual (N, 2) and jacobian (N, 2, p): measured − predicted is −residual, whitened.
    raw_residual (N, 2) N, N·m and raw_jacobian (N, 2, p): the same, not whitened. shown (N, 2): what the model says the
    sensors show, of blank and censored readings too. converged: whether the search ended at a minimum; message says how
    it ended.
    """

    model: Model
    vector: Tensor
    residual: Tensor
    jacobian: Tensor
    raw_residual: Tensor
    raw_jacobian: Tensor
    shown: Tensor
    converged: bool
    message: str

    @property
    def chi2(self) -> float:
        """Sum of the squared whitened residuals."""
        return float(self.residual.square().sum())

    def values(self) -> dict[str, float]:
        """Physical parameters, SI."""
        with torch.no_grad():
            values = self.model.physical(self.vector)
        return {name: float(values[name]) for name in self.model.declared}


class WhiteProblem:
    """Whitened residuals of a model over rows, as functions of raw vectors; whitening stays fixed."""

    def __init__(self, model: Model, rows: Rows, whiten: Whitener) -> None:
        self.problem, self.whiten = Problem(model, rows, ONE), whiten
        self.shape = (len(rows), 2)
        # Where the derivatives were last taken: a search ends there, and need not take them once more.
        self._last: tuple[Tensor, Tensor] | None = None

    def residuals(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, 2N)."""
        raw = self.problem.residuals(vectors)
        return torch.stack([self.whiten(r.reshape(self.shape)).reshape(-1) for r in raw])

    def jacobians(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, 2N, p)."""
        raw = self.problem.jacobians(vectors)
        self._last = vectors[-1].clone(), raw[-1].reshape(*self.shape, -1)
        return torch.stack([self.whiten(j.reshape(*self.shape, -1)).flatten(0, 1) for j in raw])

    def raw_jacobian(self, vector: Tensor) -> Tensor:
        """∂loads/∂vector at one vector (p,), not whitened: (N, 2, p)."""
        if self._last is not None and torch.equal(self._last[0], vector):
            return self._last[1]
        return self.problem.jacobians(vector[None])[0].reshape(*self.shape, -1)

    def asked(self, start: Tensor, rival: float | None, most: int) -> str:
        """Digest of what a fit from a start (p,) is about."""
        model = self.problem.model
        digest = hashlib.sha256(repr((model.name, model.labels(), self.shape, rival, most)).encode())
        for tensor in (start, self.whiten.own, self.whiten.shared, self.whiten.shrink):
            digest.update(tensor.detach().numpy().tobytes())
        return digest.hexdigest()[:24]

    def unmoved(self) -> WhiteProblem:
        """The same, where no earlier search for an equilibrium decides from where the next one begins: else what it
        says at a vector hangs, in its last digits, on the way there."""
        near = self.problem.states.near
        moved = self.problem.bound is not None or (near is not None and near.moved)
        return WhiteProblem(self.problem.model, self.problem.rows, self.whiten) if moved else self


def white_fit(
    model: Model, rows: Rows, whiten: Whitener, start: Tensor, rival: float | None = None, most: int = MAX_ITERATIONS
) -> WhiteFit:
    """Fits from one raw start (p,). The fit has a model of its own: the one given stays as it is, it may be another
    fit's.

    rival: χ² that the fit has to match; one that clearly cannot is given up, unconverged. most: iterations.
    """
    model = deepcopy(model)
    problem = WhiteProblem(model, rows, whiten)
    ending = ended(problem.asked(start, rival, most), lambda: _sought(problem, start, rival, most))
    vector = torch.tensor(ending["vector"], dtype=torch.float64)
    model.set_vector(vector)
    # What a fit ends with follows from its last vector alone, whether the way there was gone now or taken from a
    # journal.
    return _ended(problem.unmoved(), vector, Termination(ending["status"]), ending["message"])


def _sought(problem: WhiteProblem, start: Tensor, rival: float | None, most: int) -> Ending:
    """How the search for a minimum ends."""
    lower, upper = problem.problem.model.raw_bounds()
    solver = LevenbergMarquardt(
        problem.residuals,
        problem.jacobians,
        lower=lower,
        upper=upper,
        gtol=TOLERANCE,
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        max_iterations=most,
        batched=True,
    )
    state = solver.init(start[None])
    message = ""
    while state.running and not (message := _enough(state, problem.problem.rows.readings.count, rival)):
        state = solver.step(state)
    result = state.result().member(0)
    return Ending(vector=result.x.tolist(), status=int(result.status), message=message or state.result().message(0))


def evaluated(model: Model, rows: Rows, vector: Tensor) -> WhiteFit:
    """A model at a raw vector (p,) on other rows than it was fitted to: nothing whitened."""
    problem = Problem(model, rows, ONE)
    with torch.no_grad():
        raw = problem.residual(vector).reshape(-1, 2)
    jacobian = problem.jacobians(vector[None])[0].reshape(len(rows), 2, -1)
    shown = problem.readings(vector)
    return WhiteFit(model, vector, raw, jacobian, raw, jacobian, shown, False, "Not fitted.")


GIVEN_UP = "Given up: another model fits far better than this one can."


def _enough(state: State, count: int, rival: float | None) -> str:
    """Why a search need not go on, if so: nothing left to gain, or no chance to match the rival."""
    loss, promised = float(state.point.loss[0]), float(state.point.model.attainable()[0])
    if promised <= SETTLED * loss / count or (loss > HOPELESS * count and promised <= ROUGHLY * loss):
        return "Converged: what the linear model still promises decides nothing."
    if rival is not None and loss - TRUST * promised > BEHIND * rival:
        return GIVEN_UP
    return ""


def _ended(problem: WhiteProblem, vector: Tensor, status: Termination, message: str) -> WhiteFit:
    """The fit at its last vector. Stopped without progress or by the limit, it counts as converged only if the linear
    model there promises nothing that would decide anything: so a minimum that rounding hides is told from a kink, a
    valley and a search cut short."""
    model, whiten, shape = problem.problem.model, problem.whiten, problem.shape
    with torch.no_grad():
        raw = problem.problem.residual(vector).reshape(shape)
    raw_jacobian = problem.raw_jacobian(vector)
    residual, jacobian = whiten(raw), whiten(raw_jacobian)
    possible = status != Termination.INVALID_START and message != GIVEN_UP
    converged = status.converged or (possible and _settled(residual, jacobian, vector, model))
    shown = problem.problem.readings(vector)
    return WhiteFit(model, vector.clone(), residual, jacobian, raw, raw_jacobian, shown, converged, message)


def _settled(residual: Tensor, jacobian: Tensor, vector: Tensor, model: Model) -> bool:
    flat = residual.reshape(-1)
    promised = promise(flat, jacobian.flatten(0, 1), vector, *model.raw_bounds())
    return promised <= PROMISE * max(1.0, float(flat.square().mean()))


def promise(residual: Tensor, jacobian: Tensor, vector: Tensor, lower: Tensor, upper: Tensor) -> float:
    """By how much ‖r‖² (m,) would fall if r were linear, J (m, p), and no bound but those it rests on held.

    This is the first-order criterion of a minimum: zero where r is orthogonal to J's columns, but for parameters on a
    bound that descent points out of, and for such as hardly any residual depends on any more (a stiffness that has gone
    to zero, raw −∞): following these, a linear model would go where it does not hold.
    """
    if not bool(jacobian.isfinite().all()) or not bool(residual.isfinite().all()):
        return float("inf")
    slope = jacobian.T @ residual
    free = ~((vector <= lower) & (slope > 0)) & ~((vector >= upper) & (slope < 0))
    free &= norms(jacobian) > GONE * residual.norm()
    return float((orthonormal(jacobian[:, free]).T @ residual).square().sum())
