"""The profile interval of one parameter: what its profile goes along, how far it may go, what its ends mean."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import torch
from torch import Tensor

from freelearn.fitting.lifted import SHARE, lifted
from freelearn.fitting.problem import Problem
from freelearn.fitting.profile_end import End, Ending, EndSearch, Limit
from freelearn.fitting.profile_line import Coordinate, Line, Quantity, Spot, Squares
from freelearn.fitting.profile_scale import Allowance
from freelearn.fitting.profile_words import UNTOLD, about, away, interval_words, kept, stopped
from freelearn.models.base import Model
from freelearn.models.parameter import Parameter
from freelearn.models.prediction import Status

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
