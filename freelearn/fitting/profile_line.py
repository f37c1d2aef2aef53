"""Least sums of squares along one parameter, all others free: a profile, place by place, and where it goes next."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import torch
from torch import Tensor

from freelearn.fitting.levenberg_marquardt import Function, LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.fitting.solver import Result, Termination
from freelearn.fitting.uncertainty import RANK_TOLERANCE

# Least sums of squares along one parameter, all others free: a profile, place by place.

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
    def from_problem(cls, problem: Problem) -> Squares:
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
    """A number that several entries of the raw vector make together, such as an entry of a stiffness matrix.

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


# Which place of a profile is looked at next, on the way to the end of an interval.

# An end is found where the root of the rise is this near to its goal, as a share.
NEAR = 1e-5
# A jump of the sum of squares is an end too: the places before and behind it are then this near, as a share of the way.
NARROW = 1e-6
# A search that has not passed the end yet goes this many times the way that seems to be left: an end between two places
# is found sooner than one that is only come nearer to. On flat ground it goes at most FARTHEST_STEP times as far as
# before.
BEYOND, FARTHEST_STEP = 1.1, 4.0
# So steep a rise behind an end (its root, in units of what is allowed) tells nothing of where the end is.
STEEP = 3.0


@dataclass(frozen=True)
class Look:
    """A place's distance from the estimate, and the root of the rise there in units of what an interval allows: in a
    linear model the one is proportional to the other (profile t, Bates & Watts 1988). lag: by how much the distance
    fell short of the one asked for."""

    distance: float
    root: float
    lag: float
    spot: Spot

    def slope(self, other: Look) -> float:
        """Between two places; 0 where there is none to speak of."""
        way = self.distance - other.distance
        slope = (self.root - other.root) / way if way else 0.0
        return slope if math.isfinite(slope) else 0.0


def onward(before: Look, now: Look, count: int) -> float:
    """The next distance while no place outside is known. count: of the places so far."""
    slope = now.slope(before)
    left = BEYOND * (1 - now.root) / slope if slope > 0 else math.inf
    # Each time at least so much more, lest a rise that levels off be followed in ever shorter steps.
    least = now.distance * NEAR * 10.0**count
    return now.distance + min(max(left, least), (FARTHEST_STEP - 1) * now.distance)


class Bracket:
    """The last place inside an interval and the first one outside."""

    def __init__(self, inner: Look, outer: Look) -> None:
        self.inner, self.outer = inner, outer
        self._below, self._above, self._last = inner.root - 1, outer.root - 1, 0.0

    @property
    def narrow(self) -> bool:
        """Whether nothing is left between the two."""
        return self.outer.distance - self.inner.distance <= NARROW * self.outer.distance

    @property
    def distance(self) -> float:
        """The next distance: by the Illinois form of the false position, or half way where that cannot be trusted."""
        steep = not self.outer.spot.settled or self.outer.root > STEEP
        share = 0.5 if steep else -self._below / (self._above - self._below)
        return self.inner.distance + share * (self.outer.distance - self.inner.distance)

    def take(self, look: Look) -> None:
        """A place between the two takes the place of one."""
        now = look.root - 1
        # An end that stays twice counts half, so that the other does not creep up to it.
        half = 0.5 if now * self._last > 0 else 1.0
        if now > 0:
            self.outer, self._above, self._below = look, now, half * self._below
        else:
            self.inner, self._below, self._above = look, now, half * self._above
        self._last = now
