"""Fits of whitened residuals: what every statistic of the discovery stands on."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from freelearn.data.rows import Rows
from freelearn.data.warm_start import Near
from freelearn.discovery.fits.journal import Ending, ended
from freelearn.discovery.noise.linear_algebra import normal_inverse, norms, orthonormal
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.thresholds import PROMISE
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.fitting.solver import State, Termination
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.priors import RawPrior

# Relative differences of the sum of squares, and steps, that a fit does not pursue.
TOLERANCE = 1e-7
# Reduction of χ² that a fit does not pursue, in units of χ² per number: it moves a parameter by 0.001 σ. Of a fit that
# only has to be compared with others, where χ² per number is more than one: it moves no evidence by a hundredth.
SETTLED, COMPARED = 1e-6, 2e-2
# χ² per number beyond which a model is so wrong that a share of it decides nothing: its fit need not be pursued.
HOPELESS, ROUGHLY = 8.0, 1e-5
# A parameter has gone if a change of its raw value by one changes the residuals by less than this share of them.
GONE = 1e-4
MAX_ITERATIONS = 60
# Relative eigenvalues of what is known, each parameter in units of its own, that rounding alone would leave.
LEAST_KNOWN = 1e-13
# Steps in which the sum of squares has to fall at all: of a fit that is only to be compared, and of others.
FEW, MANY = 5, 15
# A fit need not be pursued whose χ², less so many times what the linear model promises, is so much above a rival's.
TRUST, BEHIND = 3.0, 60.0
ONE = torch.ones(2, dtype=torch.float64)


@dataclass(frozen=True)
class WhiteFit:
    """A model at its whitened least-squares optimum over N rows.

    vector: raw parameters (p,). residual (N, 2) and jacobian (N, 2, p): measured − predicted is −residual, whitened.
    raw_residual (N, 2) N, N·m and raw_jacobian (N, 2, p): the same, not whitened. shown (N, 2): what the model says the
    sensors show, of blank and censored readings too. converged: whether the search ended at a minimum; message says how
    it ended. prior: what was known of the vector beforehand, which joined the sum of squares; None for nothing. near:
    the rows' equilibria, from which a like model's are soon found.
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
    prior: RawPrior | None = None
    near: Near | None = None

    @property
    def chi2(self) -> float:
        """Sum of the squared whitened residuals."""
        return float(self.residual.square().sum())

    @property
    def proper(self) -> bool:
        """Whether it ended in a minimum with an answer for every row."""
        return self.converged and bool(self.residual.isfinite().all())

    @property
    def begin(self) -> Near | None:
        """Where a search for equilibria begins that goes on from here, whatever was held."""
        return None if self.near is None else self.near.released()

    def information_root(self, rows: Tensor | None = None, weight: float = 1.0) -> Tensor:
        """R with RᵀR what is known of the raw vector, (2n + p, p): derivatives of some rows' whitened readings,
        (N,) bool, and below them what was known beforehand. A row without an answer tells nothing.

        weight: what a reading counts, 1 for what its deviation says.
        """
        told = self.jacobian if rows is None else self.jacobian[rows]
        root = told.flatten(0, 1).nan_to_num(0.0, 0.0, 0.0) * weight**0.5
        return root if self.prior is None else torch.cat([root, self.prior.root])

    def covariance(self, rows: Tensor | None = None, weight: float = 1.0) -> Tensor:
        """Of the raw vector, as the same readings and what was known beforehand leave it: (p, p)."""
        return normal_inverse(self.information_root(rows, weight), smallest=LEAST_KNOWN)

    def values(self) -> dict[str, float]:
        """Physical parameters, SI."""
        with torch.no_grad():
            values = self.model.physical(self.vector)
        return {name: float(values[name]) for name in self.model.declared}


class SentFit(NamedTuple):
    """All of a WhiteFit but its model and what was known beforehand, which are soon made again: what can be sent from
    one process to another."""

    vector: Tensor
    residual: Tensor
    jacobian: Tensor
    raw_residual: Tensor
    raw_jacobian: Tensor
    shown: Tensor
    converged: bool
    message: str
    near: Near | None

    @classmethod
    def from_fit(cls, fit: WhiteFit) -> SentFit:
        """Of a fit."""
        return cls(*(getattr(fit, name) for name in cls._fields))

    def received(self, model: Model, prior: RawPrior | None) -> WhiteFit:
        """The fit again. model: one like the fit's."""
        model.set_vector(self.vector)
        return WhiteFit(model=model, prior=prior, **self._asdict())


class WhiteProblem:
    """Whitened residuals of a model over rows, as functions of raw vectors; whitening stays fixed. What is known of the
    vector beforehand stands below them, one number for each parameter."""

    def __init__(
        self, model: Model, rows: Rows, whiten: Whitener, prior: RawPrior | None = None, near: Near | None = None
    ) -> None:
        """near: a like fit's."""
        self.problem = Problem(model, rows, ONE, None if near is None else near.copy())
        self.whiten, self.prior = whiten, prior
        self.root = None if prior is None else prior.root
        self.shape = (len(rows), 2)
        # Where the derivatives were last taken: a search ends there, and need not take them once more.
        self._last: tuple[Tensor, Tensor] | None = None

    def residuals(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, 2N), or (members, 2N + p)."""
        raw = self.problem.tried(vectors)
        white = torch.stack([self.whiten(r.reshape(self.shape)).reshape(-1) for r in raw])
        if self.prior is None or self.root is None:
            return white
        return torch.cat([white, (vectors - self.prior.middle) @ self.root.T], dim=1)

    def jacobians(self, vectors: Tensor) -> Tensor:
        """(members, p) → (members, 2N, p), or (members, 2N + p, p)."""
        raw = self.problem.jacobians(vectors)
        self._last = vectors[-1].clone(), raw[-1].reshape(*self.shape, -1)
        white = torch.stack([self.whiten(j.reshape(*self.shape, -1)).flatten(0, 1) for j in raw])
        return white if self.root is None else torch.cat([white, self.root.expand(len(white), -1, -1)], dim=1)

    def with_prior(self, vector: Tensor, residual: Tensor, jacobian: Tensor) -> tuple[Tensor, Tensor]:
        """Whitened residuals (N, 2) and derivatives (N, 2, p) at a vector (p,) as residuals and jacobians have them:
        (2N,) and (2N, p), what is known beforehand below them."""
        flat, columns = residual.reshape(-1), jacobian.flatten(0, 1)
        if self.prior is None or self.root is None:
            return flat, columns
        return torch.cat([flat, self.root @ (vector - self.prior.middle)]), torch.cat([columns, self.root])

    def raw_jacobian(self, vector: Tensor) -> Tensor:
        """∂loads/∂vector at one vector (p,), not whitened: (N, 2, p)."""
        if self._last is not None and torch.equal(self._last[0], vector):
            return self._last[1]
        return self.problem.jacobians(vector[None])[0].reshape(*self.shape, -1)

    def asked(self, start: Tensor, roughly: bool, rival: float | None = None) -> str:
        """Digest of what a fit from a start (p,) is about."""
        model, whiten = self.problem.model, self.whiten
        digest = hashlib.sha256(repr((model.name, model.labels(), self.shape, roughly, rival)).encode())
        known = () if self.prior is None else (self.prior.middle, self.prior.covariance)
        memory = () if whiten.filter is None else (whiten.filter.left, whiten.filter.loading, whiten.filter.size)
        noise = (whiten.force, whiten.moment, whiten.shared, whiten.shrink, whiten.of_levels.along, *memory)
        for tensor in (start, *noise, *known):
            digest.update(tensor.detach().numpy().tobytes())
        return digest.hexdigest()[:24]

    def unmoved(self) -> WhiteProblem:
        """The same, where no earlier search for an equilibrium decides from where the next one begins: else what it
        says at a vector hangs, in its last digits, on the way there."""
        near = self.problem.states.near
        moved = self.problem.bound is not None or (near is not None and near.moved)
        if not moved:
            return self
        held = None if near is None or not near.held else Near(near.held)
        return WhiteProblem(self.problem.model, self.problem.rows, self.whiten, self.prior, held)


def white_fit(
    model: Model,
    rows: Rows,
    whiten: Whitener,
    start: Tensor,
    prior: RawPrior | None = None,
    roughly: bool = False,
    rival: float | None = None,
    near: Near | None = None,
) -> WhiteFit:
    """Fits from one raw start (p,). The fit has a model of its own: the one given stays as it is, it may be another
    fit's.

    prior: what is known of the vector beforehand. roughly: the fit is only to be compared with others. rival: χ² that
    it has to come near; one that clearly cannot ends where it is. near: equilibria of a like fit of the same rows.
    """
    model = deepcopy(model)
    problem = WhiteProblem(model, rows, whiten, prior, near)
    ending = ended(problem.asked(start, roughly, rival), lambda: _sought(problem, start, roughly, rival))
    vector = torch.tensor(ending["vector"], dtype=torch.float64)
    model.set_vector(vector)
    # What a fit ends with follows from its last vector alone, whether the way there was gone now or taken from a
    # journal.
    return _ended(problem.unmoved(), vector, Termination(ending["status"]), ending["message"])


def refitted(fit: WhiteFit, rows: Rows, whiten: Whitener, roughly: bool = False) -> WhiteFit:
    """A fit's model, fitted on from there to rows under a noise, with the same prior; equilibria are searched for,
    whatever was held. roughly: see white_fit."""
    return white_fit(fit.model, rows, whiten, fit.vector, fit.prior, roughly, near=fit.begin)


def _sought(problem: WhiteProblem, start: Tensor, roughly: bool, rival: float | None) -> Ending:
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
        max_iterations=MAX_ITERATIONS,
        batched=True,
    )
    state = solver.init(start[None])
    message, count, losses = "", problem.problem.rows.readings.count, list[float]()
    while state.running and not (message := _enough(state, count, roughly) or _stalled(losses, count, roughly)):
        if rival is not None and len(losses) >= FEW and (_behind(state, rival) or _slow(losses, rival)):
            message = "Ended: another model fits far better than this one can."
            break
        state = solver.step(state)
        losses.append(float(state.point.loss[0]))
    result = state.result().member(0)
    return Ending(vector=result.x.tolist(), status=int(result.status), message=message or state.result().message(0))


def evaluated(model: Model, rows: Rows, vector: Tensor) -> WhiteFit:
    """A model at a raw vector (p,) on other rows than it was fitted to: nothing whitened."""
    problem = Problem(model, rows, ONE)
    jacobian = problem.jacobians(vector[None])[0].reshape(len(rows), 2, -1)
    shown = problem.readings(vector)
    raw = problem.missed(shown).reshape(-1, 2)
    near = problem.states.near
    return WhiteFit(model, vector, raw, jacobian, raw, jacobian, shown, False, "Not fitted.", near=near)


def _enough(state: State, count: int, roughly: bool) -> str:
    """Why a search need not go on, if so: nothing left to gain."""
    loss, promised = float(state.point.loss.max()), float(state.point.model.attainable().max())
    least = _compared(loss, count) if roughly else SETTLED * loss / count
    if promised <= least or (loss > HOPELESS * count and promised <= ROUGHLY * loss):
        return "Converged: what the linear model still promises decides nothing."
    return ""


def _compared(loss: float, count: int) -> float:
    """Reduction of χ² that decides nothing between fits of so many numbers that are to be compared: where these miss by
    more than their noise, the more as the square."""
    return max(COMPARED, COMPARED * loss / count, ROUGHLY * loss)


def _behind(state: State, rival: float) -> bool:
    """Whether a search cannot come near a rival's χ², though the linear model promised several times as much."""
    loss, promised = float(state.point.loss[0]), float(state.point.model.attainable()[0])
    return loss - TRUST * promised > rival + BEHIND


def _slow(losses: Sequence[float], rival: float) -> bool:
    """Whether at the pace of its last steps a search comes near a rival's χ² in none of those that it may take: where
    rows have no equilibrium, the linear model may promise for long what no step brings."""
    steps = min(FEW, len(losses) - 1)
    fallen = losses[-steps - 1] - losses[-1]
    return losses[-1] - fallen * (MAX_ITERATIONS - len(losses)) / steps > rival + BEHIND


def _stalled(losses: Sequence[float], count: int, roughly: bool) -> str:
    """Why a search whose loss no longer falls need not go on, if so: at a kink, where a tube begins to hang loose, say,
    steps become ever shorter."""
    steps = FEW if roughly else MANY
    if len(losses) <= steps:
        return ""
    least = steps * _compared(losses[-1], count) if roughly else COMPARED
    return "The sum of squares no longer falls." if losses[-steps - 1] - losses[-1] <= least else ""


def _ended(problem: WhiteProblem, vector: Tensor, status: Termination, message: str) -> WhiteFit:
    """The fit at its last vector. Stopped without progress or by the limit, it counts as converged only if the linear
    model there promises nothing that would decide anything: so a minimum that rounding hides is told from a kink, a
    valley and a search cut short."""
    model, whiten, shape = problem.problem.model, problem.whiten, problem.shape
    # First, because what comes after it begins at the equilibria that it finds.
    raw_jacobian = problem.raw_jacobian(vector)
    shown = problem.problem.readings(vector)
    raw = problem.problem.missed(shown).reshape(shape)
    residual, jacobian = whiten(raw), whiten(raw_jacobian)
    converged = status.converged or (
        status != Termination.INVALID_START and _settled(problem, residual, jacobian, vector)
    )
    near = problem.problem.states.near
    return WhiteFit(
        model, vector.clone(), residual, jacobian, raw, raw_jacobian, shown, converged, message, problem.prior, near
    )


def _settled(problem: WhiteProblem, residual: Tensor, jacobian: Tensor, vector: Tensor) -> bool:
    flat, columns = problem.with_prior(vector, residual, jacobian)
    promised = promise(flat, columns, vector, *problem.problem.model.raw_bounds())
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
