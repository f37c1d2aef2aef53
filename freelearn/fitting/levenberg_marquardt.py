"""Nonlinear least squares by the Levenberg-Marquardt method, several starts at a time.

The loss is the sum of squared residuals ‖r(x)‖².  Steps come from a trust region (see `trust_region`), whose
radius follows the ratio of actual to predicted reduction as in MINPACK (Moré, Garbow and Hillstrom, User
Guide for MINPACK-1, ANL-80-74, 1980).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import torch
from torch import Tensor

from freelearn.fitting.solver import Point, Result, State, Termination, put, take
from freelearn.fitting.trust_region import Reduced, linear_model, reduced, trial_point, triangular_factor

EPS = torch.finfo(torch.float64).eps
# A sum of squares may change by this fraction through rounding alone.
ROUNDING = 64 * EPS
SMALLEST_GAIN = 1e-4
# First radius, in units of ‖D x‖. MINPACK takes 100; from there BoxBOD's first start lands on a plateau and stays.
FIRST_RADIUS = 10.0
SHORTEST_RADIUS = 1e-150

# Residuals whose squares are summed at once.
SUMMED = 1_000_000

Function = Callable[[Tensor], Tensor]
Pieces = Callable[[Tensor], Iterable[Tensor]]


class LevenbergMarquardt:
    """Minimizer of ‖r(x)‖² for a vector of residuals r, optionally within a box.

    Args:
        residual: r, from parameters (p,) to residuals (m,), in pure torch, float64.
        jacobian: ∂r/∂x, from parameters (p,) to (m, p); by default `residual` is differentiated forward.
        lower, upper: bounds (p,) of the parameters, ±inf where there is none; starts outside are moved in.
        gtol: converged when |Jⱼ·r| ≤ gtol ‖Jⱼ‖ ‖r‖ for every free parameter j.
        ftol: converged when the reduction of the loss, and the largest the linear model can offer at any
            radius, are both at most ftol times the loss; the default is below what rounding lets a step show.
        xtol: converged when the unconstrained step p has ‖J p‖ ≤ xtol ‖D x‖, D the norms of J's columns: the
            residuals it changes are then below what a relative change xtol of the parameters does.
        max_iterations: most trial steps per member.
        pieces: in place of `jacobian`, where that would take too much memory: parameters (members, p) to its rows
            from above to below, (members, some, p) at a time.
        batched: `residual` and `jacobian` take all members at once, (members, p) → (members, m[, p]).

    While several members (rows of x) run, residual and Jacobian go through `torch.func.vmap`; a single one
    calls them directly.  Each member has its own trust region and status, and stays put once it has finished.
    Steps that raise the loss, or meet residuals or Jacobians that are not finite, are never taken.

    Raises:
        ValueError: a bound or start of wrong shape, a start not float64, lower > upper, a residual no vector.
    """

    def __init__(
        self,
        residual: Function,
        jacobian: Function | None = None,
        *,
        lower: Tensor | None = None,
        upper: Tensor | None = None,
        gtol: float = 1e-12,
        ftol: float = 1e-19,
        xtol: float = 1e-15,
        max_iterations: int = 2000,
        batched: bool = False,
        pieces: Pieces | None = None,
    ) -> None:
        self.residual, self.pieces = residual, pieces
        self.batched = batched
        self.jacobian = torch.func.jacfwd(residual) if jacobian is None else jacobian
        bounded = lower if lower is not None else upper
        self.lower, self.upper = lower, upper
        if bounded is not None:
            self.lower = torch.full_like(bounded, -torch.inf) if lower is None else lower
            self.upper = torch.full_like(bounded, torch.inf) if upper is None else upper
            if self.lower.shape != self.upper.shape or not bool((self.lower <= self.upper).all()):
                raise ValueError("lower and upper need the same shape, and lower ≤ upper everywhere")
        self.gtol, self.ftol, self.xtol = gtol, ftol, xtol
        self.max_iterations = max_iterations

    def solve(self, x0: Tensor) -> Result:
        """Run all members to their end from x0 (p,) or (members, p); the result has x0's shape."""
        state = self.init(x0)
        while state.running:
            state = self.step(state)
        result = state.result()
        return result if x0.ndim == 2 else result.member(0)

    @torch.no_grad()
    def init(self, x0: Tensor) -> State:
        """State at the starts x0 (p,) or (members, p)."""
        x = (x0[None] if x0.ndim == 1 else x0).detach().clone()
        if x.ndim != 2 or x.dtype != torch.float64:
            raise ValueError(f"x0 must be float64 of shape (p,) or (members, p), not {x0.dtype} {tuple(x0.shape)}")
        if self.lower is not None:
            if self.lower.shape != x.shape[1:]:
                raise ValueError(f"bounds of shape {tuple(self.lower.shape)} do not fit {x.shape[1]} parameters")
            x = x.clamp(self.lower, self.upper)
        residual = self._evaluate(self.residual, x)
        if residual.ndim != 2:
            raise ValueError(f"residual must return a vector (m,), not shape {tuple(residual.shape[1:])}")
        point, valid = self._linearize(x, residual, torch.zeros_like(x))
        distance = torch.linalg.vector_norm(point.model.scale * x, dim=-1)
        counts = torch.zeros(x.shape[0], dtype=torch.int64, device=x.device)
        status = torch.where(valid, self._stationary(point, counts), int(Termination.INVALID_START))
        radius = torch.where(distance > 0, FIRST_RADIUS * distance, FIRST_RADIUS)
        return State(point, radius, status, counts, counts + 1, counts + 1)

    @torch.no_grad()
    def step(self, state: State) -> State:
        """Try one step for every running member; the others are returned untouched."""
        running = state.status == Termination.RUNNING
        if running.all():
            return self._advance(state)
        rows = running.nonzero().squeeze(-1)
        return put(state, rows, self._advance(take(state, rows))) if len(rows) else state

    def _advance(self, state: State) -> State:
        old = state.point
        x = trial_point(old.model, old.x, state.radius, self.lower, self.upper)
        residual = self._evaluate(self.residual, x)
        # Taken as one sum, the reduction keeps digits that the difference of the two losses would lose.
        actual = _summed(lambda r, s: (r - s) * (r + s), old.residual, residual)
        predicted = old.model.predicted_reduction(x - old.x)
        loss = _summed(torch.mul, residual, residual)
        better = (actual > 0) & (loss <= old.loss) & (predicted > 0) & (actual >= SMALLEST_GAIN * predicted)
        point, moved = self._move(old, x, residual, better)
        gain = torch.where(moved, actual / predicted, -torch.inf)
        radius = self._radius(state, x - old.x, gain, actual)
        evaluations, derivatives = state.evaluations + 1, state.jacobian_evaluations + better
        new = State(point, radius, state.status, state.iterations + 1, evaluations, derivatives)
        return new._replace(status=self._assess(new, old, torch.where(moved, actual, 0.0), moved))

    def _move(self, old: Point, x: Tensor, residual: Tensor, better: Tensor) -> tuple[Point, Tensor]:
        """Trial points of members where they are better and finite, old points of the rest; who moved."""
        if better.all():
            point, valid = self._linearize(x, residual, old.norms)
            if valid.all():
                return point, valid
        rows = better.nonzero().squeeze(-1)
        if not len(rows):
            return old, better
        point, valid = self._linearize(x[rows], residual[rows], old.norms[rows])
        moved = better.clone()
        moved[rows] = valid
        return put(old, rows[valid], take(point, valid)), moved

    def _linearize(self, x: Tensor, residual: Tensor, norms: Tensor) -> tuple[Point, Tensor]:
        """Point at x (members, p) and whether all there is finite; where it is not the model is all zeros.

        `norms` are the largest column norms so far: as in MINPACK the scale D of a parameter never falls.
        """
        loss = _summed(torch.mul, residual, residual)
        if self.pieces is None:
            jacobian = self._evaluate(self.jacobian, x)
            columns = torch.linalg.vector_norm(jacobian, dim=-2)
            valid = loss.isfinite() & columns.isfinite().all(-1)
            if not valid.all():
                jacobian = torch.where(valid[:, None, None], jacobian, 0.0)
                columns = torch.where(valid[:, None], columns, 0.0)
            usable = residual if valid.all() else torch.where(valid[:, None], residual, 0.0)
            factored = Reduced(*triangular_factor(jacobian, usable), columns)
        else:
            jacobian, usable = residual.new_zeros(len(x), 0, x.shape[-1]), residual
            factored = reduced(self.pieces(x), residual)
            valid = loss.isfinite() & factored.columns.isfinite().all(-1)
            if not valid.all():
                usable = torch.where(valid[:, None], residual, 0.0)
                factored = Reduced(*(torch.where(valid.view(-1, *[1] * (t.ndim - 1)), t, 0.0) for t in factored))
        loss = torch.where(loss.isfinite(), loss, torch.inf)
        norms = torch.maximum(norms, factored.columns)
        model, gradient = linear_model(factored, usable, norms, x, self.lower, self.upper)
        size = torch.linalg.vector_norm(factored.columns * x, dim=-1)
        return Point(x, residual, loss, jacobian, norms, gradient, size, model), valid

    def _assess(self, state: State, old: Point, actual: Tensor, moved: Tensor) -> Tensor:
        """Termination (members,) after a step from the point `old` that reduced the loss by `actual`."""
        at, model = state.point, state.point.model
        status = torch.where(state.iterations >= self.max_iterations, int(Termination.MAX_ITERATIONS), state.status)
        distance = torch.linalg.vector_norm(model.scale * at.x, dim=-1)
        stuck = ~moved & (state.radius <= EPS * distance.clamp(min=SHORTEST_RADIUS))
        # Rounding the parameters alone moves the residuals by about EPS times `size`.
        noise = ROUNDING * (at.loss + at.loss.sqrt() * at.size)
        noisy = model.attainable() <= noise
        stopped = torch.where(noisy, int(Termination.CONVERGED_LOSS), int(Termination.NO_PROGRESS))
        status = torch.where(stuck, stopped, status)
        flat = (old.model.attainable() <= self.ftol * old.loss) & (actual <= self.ftol * old.loss)
        status = torch.where(flat, int(Termination.CONVERGED_LOSS), status)
        return self._stationary(at, status)

    def _stationary(self, at: Point, status: Tensor) -> Tensor:
        """The status (members,) given, or convergence where the point itself shows it."""
        short = at.model.attainable().sqrt() <= self.xtol * at.size
        status = torch.where(short, int(Termination.CONVERGED_STEP), status)
        return torch.where(at.gradient <= self.gtol, int(Termination.CONVERGED_GRADIENT), status)

    def _radius(self, state: State, step: Tensor, gain: Tensor, actual: Tensor) -> Tensor:
        """Next radius (members,) after a step whose ratio of actual to predicted reduction is `gain`."""
        model = state.point.model
        length = torch.linalg.vector_norm(model.scale * step, dim=-1)
        radius = torch.where(state.iterations == 0, torch.minimum(state.radius, length), state.radius)
        # Where the loss rose, the parabola through slope and values is lowest at this fraction of the step.
        slope = model.slope(step)
        fraction = (0.5 * slope / (slope + 0.5 * actual)).clamp(0.1, 0.5)
        fraction = torch.where(actual >= 0, 0.5, fraction).nan_to_num(nan=0.1)
        shorter = fraction * torch.minimum(radius, 10.0 * length)
        inside = length < 0.99 * radius
        kept = torch.where((gain >= 0.75) | inside, 2.0 * length, radius)
        return torch.where(gain > 0.25, kept, shorter)

    def _evaluate(self, function: Function, x: Tensor) -> Tensor:
        """Values of the function for all rows of x (members, p)."""
        if self.batched:
            return function(x).detach()
        if x.shape[0] == 1:
            # Called directly: data-dependent early exits inside the function work, and pay, only outside vmap.
            return function(x[0]).detach().unsqueeze(0)
        return torch.func.vmap(function, randomness="error")(x).detach()


def _summed(terms: Callable[[Tensor, Tensor], Tensor], first: Tensor, second: Tensor) -> Tensor:
    """Sum over the last axis of terms of two tensors (members, m), without holding all of very many terms."""
    if first.shape[-1] <= SUMMED:
        return terms(first, second).sum(-1)
    parts = zip(first.split(SUMMED, -1), second.split(SUMMED, -1), strict=True)
    return torch.stack([terms(*part).sum(-1) for part in parts]).sum(0)
