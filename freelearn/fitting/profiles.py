"""Profile-likelihood intervals of fitted physical parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.fitting.options import PROFILE
from freelearn.fitting.problem import Problem
from freelearn.fitting.profile_allowance import Allowance, allowances, gone
from freelearn.fitting.profile_end import (
    EXACT,
    LOWER,
    NETWORK,
    SAME,
    SEVERAL,
    SHARED,
    UNTOLD,
    WEIGHTS,
    BetterFitError,
    End,
    Ending,
    EndSearch,
    Limit,
    about,
    away,
    beside,
    elsewhere,
    interval_words,
    kept,
    stopped,
)
from freelearn.fitting.profile_line import Coordinate, Line, Quantity, Spot, Squares
from freelearn.fitting.uncertainty import Uncertainty, as_fitted
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.chain.prediction import Status

# Positive parameters are lifted by this share of themselves, those that are smaller to this share of their start.
SHARE = 1e-3


def lifted(model: Model[Any], vector: Tensor) -> Tensor:
    """A raw vector (p,) with every positive parameter a little larger, and at least a thousandth of its start.

    A logarithm that went to −∞, or a stiffness matrix at the edge of positive definiteness, has derivatives of next to
    nothing: a search that goes on from there cannot feel what it would gain by coming back.
    """
    with torch.no_grad():
        physical = model.physical(vector)
    values = {name: float(physical[name]) for name in model.declared}
    for name, spec in model.declared.items():
        if not spec.fixed and (spec.log or spec.lower == 0):
            least = SHARE * abs(spec.start)
            values[name] = min(max(values[name] * (1 + SHARE), least), spec.upper)
    if not all(map(math.isfinite, values.values())):
        return vector
    try:
        raw = model.to_raw(values)
    except UserError:
        return vector
    moved = vector.clone()
    moved[len(vector) - len(raw) :] = torch.stack(list(raw.values()))
    return moved


# The profile interval of one parameter: what its profile goes along, how far it may go, what its ends mean.

# An open side is followed this many times as far as the estimate, or the size of a noticeable effect, is large; where
# the logarithm is fitted, to so many times (or a share so small of) the estimate and the start.
FAR = 1e6
# First steps along a logarithm are at most this long.
LONGEST_STEP = math.log(10.0)
# A profile goes along an entry of the raw vector where the parameter is a function of it alone, as tried by moves of
# this size.
TRIAL = 0.1
# A rise of less than this share of the least sum of squares is lost in how well a minimum is found.
FAINT = 1e-7
# A minimum this near to the fit, as a share of the interval's reach, is the fit.
SAME_PLACE = 0.05


class Interval(NamedTuple):
    """low, high: in the parameter's unit, infinite where a side is open; NaN where the normal interval has to stay.
    words: what should be known of it."""

    low: float
    high: float
    words: str


@dataclass(frozen=True)
class ParameterProfile:
    """One parameter of a fitted model. center: the minimum; fitted: the parameter's place where the fit ended;
    wary: see EndSearch."""

    problem: Problem
    squares: Squares
    line: Line
    name: str
    center: Spot
    fitted: float
    allowance: Allowance
    wary: bool

    def interval(self, told: Callable[[int], None]) -> Interval:
        """Both ends. told: how many are known, before and after each. Raises BetterFitError."""
        if self.allowance.rise <= FAINT * self.center.loss:
            return Interval(math.nan, math.nan, kept(UNTOLD))
        search = EndSearch(
            self.squares, self.line, self.center, self.allowance, self.reach,
            partial(lifted, self.problem.model), self.wary, self._answers,
        )  # fmt: skip
        told(0)
        low = search.toward(self._limit(-1), self.reach)
        told(1)
        high = search.toward(self._limit(1), max(self.reach, self._way_back()))
        told(2)
        return self._judged(low, high)

    @property
    def spec(self) -> Parameter:
        """What the parameter is."""
        return self.problem.model.declared[self.name]

    def _judged(self, low: End, high: End) -> Interval:
        unit = self.spec.unit
        for end, which in ((low, "lower"), (high, "upper")):
            if end.ending is Ending.STOPPED:
                return Interval(math.nan, math.nan, kept(stopped(which, self._value(end.place), unit)))
        if not low.place <= self.fitted <= high.place:
            return Interval(math.nan, math.nan, kept(away(self._value(self.center.place), unit)))
        ends = self._outer(low, -1), self._outer(high, 1)
        words = interval_words(low, high, ends, self.spec)
        if abs(self.center.place - self.fitted) > SAME_PLACE * self.reach and math.isfinite(self.allowance.reach):
            words = "; ".join(filter(None, [words, about(self._value(self.center.place), unit)]))
        return Interval(*ends, words)

    @property
    def reach(self) -> float:
        """About how far an end is from the estimate, as a place."""
        told = self.allowance.reach
        if self.spec.log:
            return min(told, LONGEST_STEP) if told > 0 else LONGEST_STEP
        return told if 0 < told < math.inf else self.spec.scale or 0.1 * abs(self.center.place) or 1.0

    def _way_back(self) -> float:
        """From a logarithm that went to −∞ to where the parameter begins to matter: there is nothing between."""
        return math.log(SHARE * self.spec.start) - self.center.place if self.spec.log else 0.0

    def _limit(self, side: int) -> Limit:
        """As far as the search goes down (side −1) or up (1)."""
        spec, here = self.spec, self.center.place
        # The bounds of the line itself: a logarithm's, where the line is one.
        bound = spec.raw_bounds[0 if side < 0 else 1]
        if math.isfinite(bound):
            return Limit(bound, Ending.BOUND)
        if spec.log:
            start = math.log(spec.start)
            return Limit((max(here, start) if side > 0 else min(here, start)) + side * math.log(FAR), Ending.OPEN)
        return Limit(here + side * FAR * max(abs(here), spec.scale or 0.0, self.reach), Ending.OPEN)

    def _value(self, place: float) -> float:
        """A place in the parameter's unit."""
        return float(self.spec.to_physical(torch.tensor(place, dtype=torch.float64)))

    def _outer(self, end: End, side: int) -> float:
        """An end in the parameter's unit; of an open side, its infimum or supremum."""
        if end.ending is not Ending.OPEN:
            return self._value(end.place)
        return 0.0 if side < 0 and self.spec.log else side * math.inf

    def _answers(self, vector: Tensor) -> bool:
        """Whether the model has an answer in every row."""
        model = self.problem.model
        with torch.no_grad():
            status: Tensor = model(self.problem.rows.states, model.physical(vector)).status
        return bool((status == Status.OK).all())


def line_of(model: Model[Any], name: str, vector: Tensor) -> Line:
    """What the profile of a parameter goes along: its logarithm where that is fitted, else its value in SI."""
    spec, index = model.declared[name], model.labels().index(name)

    def value(at: Tensor) -> Tensor:
        number = model.physical(at)[name]
        return number.log() if spec.log else number

    steps = torch.arange(1, len(vector) + 1, dtype=vector.dtype) / len(vector)
    trials = [vector, vector + TRIAL, vector - TRIAL * steps]
    alone = all(torch.equal(model.physical(at)[name], spec.to_physical(at[index])) for at in trials)
    return Coordinate(index) if alone else Quantity(value)


# Told of a parameter whose ends are being looked for: its name, how many ends are known, and of how many.
ProgressCallback = Callable[[str, int, int], None]

# How many times a better fit, met by a profile, becomes the minimum that the profiles are about.
MOST_BEGINNINGS = 3
# Residuals (readings divided by the largest) whose root mean square is less than this are rounding.
ROUNDING = 1e-9


def profiled(problem: Problem, known: Uncertainty, told: ProgressCallback | None = None) -> Uncertainty:
    """`known` with profile intervals of the physical parameters in the place of the normal ones.

    problem: the rows of the fit, its model at the fitted parameters, which stay as they are. The profile is of the sum
    of squares that the fit minimized: for each value of a parameter the least sum over all others. Its interval holds
    the values at which that sum is above the minimum by no more than profile_scale.allowances gives. So it knows the
    bounds, is asymmetric where the model is, and is the same in whatever form a parameter is fitted (Bates & Watts
    1988, chapter 6; Venzon & Moolgavkar 1988). An end that the rows do not tell is infinite, or the bound, and words
    say so; where a search does not come to an end, words say so and the normal interval stays.
    """
    problem = as_fitted(problem)
    model = problem.model
    if not model.declared:
        return replace(known, remark=WEIGHTS)
    if model.needs_validation:
        return replace(known, remark=NETWORK)
    squares = Squares.from_problem(problem)
    start = model.vector().detach()
    for _ in range(MOST_BEGINNINGS):
        try:
            return _about(_minimum(model, squares, start), problem, squares, known, told)
        except BetterFitError as found:
            start = found.vector
    return replace(known, remark=SEVERAL)


def _minimum(model: Model[Any], squares: Squares, start: Tensor) -> Tensor:
    """The raw vector (p,) of the least sum of squares near a start: the start itself where it is as good."""
    found = [(squares.at(start), start)]
    for vector in (start, lifted(model, start)):
        result = squares.least(vector)
        if float(result.loss) < (1 - SAME) * found[-1][0]:
            found.append((float(result.loss), result.x))
    return found[-1][1]


def _about(
    vector: Tensor, problem: Problem, squares: Squares, known: Uncertainty, told: ProgressCallback | None
) -> Uncertainty:
    """The intervals about a minimum (p,). Raises BetterFitError where that is none."""
    model = problem.model
    fitted = model.vector().detach()
    loss = squares.at(vector)
    lines = {name: line_of(model, name, vector) for name, p in model.declared.items() if not p.fixed}
    allowed = allowances(problem, vector, [line.slope(vector) for line in lines.values()], known.freedom)
    # A search that goes on from where something has gone to nothing cannot find it again.
    wary = bool(gone(problem, vector, problem.jacobians(vector[None])[0].norm(dim=0)).any())
    nothing = ROUNDING**2 * known.residuals
    least, most = (choose(allowance.rise for allowance in allowed) for choose in (min, max))
    if most <= max(nothing, FAINT * loss):
        return replace(known, remark=EXACT if loss <= nothing else SHARED)
    values = {name: float(value) for name, value in _scalars(model, vector).items()}
    if known.chi_square - loss > most:
        return replace(known, remark=elsewhere(known.chi_square, loss, values))
    found: dict[str, Interval] = {}
    for (name, line), allowance in zip(lines.items(), allowed, strict=True):
        done = 2 * len(found)

        def tell(ends: int, name: str = name, done: int = done) -> None:
            if told:
                told(name, done + ends, 2 * len(lines))

        center = Spot(line.place(vector), loss, vector, True)
        profile = ParameterProfile(problem, squares, line, name, center, line.place(fitted), allowance, wary)
        found[name] = profile.interval(tell)
    remark = beside(known.chi_square, loss, values) if known.chi_square - loss > LOWER * least else ""
    return _joined(known, found, remark)


def _scalars(model: Model[Any], vector: Tensor) -> dict[str, Tensor]:
    with torch.no_grad():
        values = model.physical(vector)
    return {name: values[name] for name in model.declared}


def _joined(known: Uncertainty, found: dict[str, Interval], remark: str) -> Uncertainty:
    """The intervals that were found in the place of the normal ones."""
    low, high = known.low.copy(), known.high.copy()
    kinds, words = list(known.kinds), list(known.words)
    for name, interval in found.items():
        i = known.names.index(name)
        words[i] = interval.words
        if not math.isnan(interval.low):
            low[i], high[i], kinds[i] = interval.low, interval.high, PROFILE
    return replace(known, low=low, high=high, kinds=kinds, words=words, remark=remark)
