"""Least sums of squares along one parameter, all others free: a profile, place by place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import torch
from torch import Tensor

from freelearn.fitting.levenberg_marquardt import Function, LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.fitting.solver import Result, Termination
from freelearn.fitting.uncertainty import RANK_TOLERANCE

# Convergence of each search (see LevenbergMarquardt), and its most steps.
TOLERANCE = 1e-10
MOST_STEPS = 100
# A search that found no way down has arrived all the same where the residuals' linear model promises less than this
# share of the rise that ends an interval.
NOTHING_LEFT = 1e-4
# No raw parameter goes on by more than this many times its own size, or one.
FARTHEST = 10.0
# How stiffly a quantity is drawn to its place: the square of its pull, in units of the rise that ends an interval, for
# each reach from the estimate.
STIFF = 1e4


class Squares(NamedTuple):
    """A sum of squares. residuals: raw vectors (members, p) → (members, m); jacobians: → (members, m, p); lower, upper:
    the box (p,) in which the vectors stay."""

    residuals: Function
    jacobians: Function
    lower: Tensor
    upper: Tensor

    @classmethod
    def of(cls, problem: Problem) -> Squares:
        """Those that a fit minimizes."""
        return cls(problem.residuals, problem.jacobians, *problem.model.raw_bounds())

    def at(self, vector: Tensor) -> float:
        """The sum at a raw vector (p,); infinite where it does not exist."""
        with torch.no_grad():
            total = float(self.residuals(vector[None]).square().sum())
        return total if total < torch.inf else torch.inf

    def least(self, start: Tensor, rise: float = 0.0) -> Result:
        """The minimum below a start (p,). rise: a step that fails where less than a small share of it can be gained
        ends the search; it would go on for long where a logarithm went to −∞."""
        solver = LevenbergMarquardt(
            self.residuals, self.jacobians, lower=self.lower, upper=self.upper,
            gtol=TOLERANCE, ftol=TOLERANCE, xtol=TOLERANCE, max_iterations=MOST_STEPS, batched=True,
        )  # fmt: skip
        state = solver.init(start)
        while state.running:
            refused, state = state, solver.step(state)
            if torch.equal(state.x, refused.x) and self.arrived(state.result().member(0), rise):
                break
        return state.result().member(0)

    def arrived(self, result: Result, rise: float) -> bool:
        """Whether a search came to a minimum, or to where less than a small share of `rise` can be gained."""
        if Termination(int(result.status)).converged:
            return True
        if not bool(result.loss.isfinite()):
            return False
        downhill = result.jacobian.T @ result.residual
        stopped = ((result.x <= self.lower) & (downhill > 0)) | ((result.x >= self.upper) & (downhill < 0))
        # A logarithm that went to −∞ has nothing to gain however far it goes, although its column may point along r.
        far = FARTHEST * result.x.abs().clamp_min(1.0)
        columns = result.jacobian[:, ~stopped & (2 * far * downhill.abs() > NOTHING_LEFT * rise)]
        if not columns.shape[1]:
            return True
        left, singular, _ = torch.linalg.svd(columns / columns.norm(dim=0), full_matrices=False)
        reached = (left.T @ result.residual)[singular > RANK_TOLERANCE * singular.max()]
        return float(reached.square().sum()) <= NOTHING_LEFT * rise


class Spot(NamedTuple):
    """One place of a profile: the parameter's place there, the least sum of squares, where it is reached, and whether
    the search for it arrived."""

    place: float
    loss: float
    vector: Tensor
    settled: bool


class Line(Protocol):
    """What a profile goes along: a number that a raw vector has. slope: its derivatives (p,)."""

    def place(self, vector: Tensor) -> float:
        """The number at a raw vector (p,)."""

    def slope(self, vector: Tensor) -> Tensor:
        """Its derivatives (p,) by the raw vector."""

    def least(self, squares: Squares, place: float, starts: Sequence[Tensor], rise: float, reach: float) -> Spot:
        """The least sum of squares where the number is `place`, or nearly so, sought from the best of the starts.

        rise: by which the sum may grow in an interval; reach: about how far its end is from the estimate."""


@dataclass(frozen=True)
class Coordinate:
    """One entry of the raw vector: a parameter that the fit moves itself, or whose logarithm it moves."""

    index: int

    def place(self, vector: Tensor) -> float:
        """See Line."""
        return float(vector[self.index])

    def slope(self, vector: Tensor) -> Tensor:
        """See Line."""
        slope = torch.zeros_like(vector)
        slope[self.index] = 1.0
        return slope

    def least(self, squares: Squares, place: float, starts: Sequence[Tensor], rise: float, reach: float) -> Spot:
        """See Line: the box is closed around the place."""
        lower, upper = squares.lower.clone(), squares.upper.clone()
        lower[self.index] = upper[self.index] = place
        held = squares._replace(lower=lower, upper=upper)
        result = held.least(_best(held, starts), rise)
        return Spot(place, float(result.loss), result.x, held.arrived(result, rise))


@dataclass(frozen=True)
class Quantity:
    """A number that several entries of the raw vector make together, such as a stiffness out of Cholesky factors.

    A minimum of S + w² (q − c)² is a minimum of S among all vectors with its own q, so it lies on the profile whatever
    w and c are; only where on the profile is not known beforehand, which a search for an end need not know.
    """

    value: Callable[[Tensor], Tensor]

    def place(self, vector: Tensor) -> float:
        """See Line."""
        return float(self.value(vector))

    def slope(self, vector: Tensor) -> Tensor:
        """See Line."""
        slope: Tensor = torch.func.grad(self.value)(vector)
        return slope.detach()

    def least(self, squares: Squares, place: float, starts: Sequence[Tensor], rise: float, reach: float) -> Spot:
        """See Line: a residual more draws the number to the place."""
        pull = (STIFF * rise) ** 0.5 / reach

        def residuals(vectors: Tensor) -> Tensor:
            drawn = torch.stack([pull * (self.value(v) - place) for v in vectors])
            return torch.cat([squares.residuals(vectors), drawn[:, None]], dim=1)

        def jacobians(vectors: Tensor) -> Tensor:
            drawn = torch.stack([pull * self.slope(v) for v in vectors])
            return torch.cat([squares.jacobians(vectors), drawn[:, None]], dim=1)

        drawn = squares._replace(residuals=residuals, jacobians=jacobians)
        result = drawn.least(_best(drawn, starts), rise)
        loss = float(result.residual[:-1].square().sum())
        return Spot(self.place(result.x), loss, result.x, drawn.arrived(result, rise))


def _best(squares: Squares, starts: Sequence[Tensor]) -> Tensor:
    """The start (p,) with the smallest sum of squares, moved into the box."""
    inside = [start.clamp(squares.lower, squares.upper) for start in starts]
    return inside[0] if len(inside) == 1 else min(inside, key=squares.at)
