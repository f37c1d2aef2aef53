"""Where a profile's sum of squares has risen by what an interval allows: the search for one end, and its words."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import Enum
from typing import NamedTuple

from torch import Tensor

from freelearn.fitting.profile_allowance import Allowance
from freelearn.fitting.profile_line import NEAR, Bracket, Line, Look, Spot, Squares, onward
from freelearn.physics.chain.parameters import Parameter

# Where a profile's sum of squares has risen by what an interval allows: the search for one end.

# A search for an end looks at this many places at most.
MOST_PLACES = 40
# As many searches for a place's least sum of squares may fail to arrive, where the model has an answer in every row.
MOST_LOST = 6
# A sum of squares that is lower than the fit's by this share of the rise is a better fit.
LOWER = 1e-3
# Sums of squares that differ by less than this share are of one minimum.
SAME = 1e-9


class Ending(Enum):
    """How one side of an interval ends: at a place that was found; at a bound of the parameter; nowhere; where the
    model loses its answer in some rows; or the search did not come to an end."""

    FOUND = "found"
    BOUND = "bound"
    OPEN = "open"
    LOST = "lost"
    STOPPED = "stopped"


class Limit(NamedTuple):
    """As far as a search goes, as a place: a bound, or so far away that the side counts as open."""

    place: float
    ending: Ending


class End(NamedTuple):
    """place: of the end, or how far the search came. rise: there, as a share of what an interval allows."""

    place: float
    ending: Ending
    rise: float


class BetterFitError(Exception):
    """A profile met a smaller sum of squares than the fit's. vector: (p,), where."""

    def __init__(self, vector: Tensor) -> None:
        super().__init__("a smaller sum of squares than the fit's")
        self.vector = vector


class EndSearch:
    """Both ends of one profile.

    line: what it goes along. center: the minimum. allowance: of the sum's rise. reach: about how far the ends are.
    lifted: a second start for a place's search, from a vector (p,), where the first may have got stuck; wary: whether
    it is tried everywhere, and not only where an end may be. answers: whether the model has an answer in every row at
    a vector (p,).
    """

    def __init__(
        self,
        squares: Squares,
        line: Line,
        center: Spot,
        allowance: Allowance,
        reach: float,
        lifted: Callable[[Tensor], Tensor],
        wary: bool,
        answers: Callable[[Tensor], bool],
    ) -> None:
        self.squares, self.line, self.center, self.allowance, self.reach = squares, line, center, allowance, reach
        self.lifted, self.wary, self.answers = lifted, wary, answers

    def toward(self, limit: Limit, first: float) -> End:
        """The end on the side of `limit`. first: distance of the place looked at first. Raises BetterFitError."""
        side = math.copysign(1.0, limit.place - self.center.place)
        room = abs(limit.place - self.center.place)
        before = inner = Look(0.0, 0.0, 0.0, self.center)
        bracket: Bracket | None = None
        distance, lost = min(first, room), 0
        for count in range(MOST_PLACES):
            look = self._look(side, distance, inner, *([bracket.outer] if bracket else []))
            if abs(look.root - 1) <= NEAR:
                return self._found(side, look, inner)
            if look.root < 1 and distance >= room:
                return End(limit.place, limit.ending, look.root**2)
            if bracket:
                bracket.take(look)
            elif look.root > 1:
                bracket = Bracket(inner, look)
            lost += not look.spot.settled and self.answers(look.spot.vector)
            if bracket and (bracket.narrow or lost > MOST_LOST):
                if self._levels_off(before, bracket, room):
                    return End(limit.place, limit.ending, inner.root**2)
                # What is outside as seen from one side may be inside as seen from the other.
                look = self._look(side, bracket.outer.distance, bracket.inner)
                if look.root > 1:
                    return self._jump(bracket.inner, look)
                inner, bracket = bracket.inner, None
            if lost > MOST_LOST:
                break
            now = bracket.inner if bracket else look
            distance = bracket.distance if bracket else min(room, onward(inner, look, count))
            if now is not inner:
                before, inner = inner, now
        return End(inner.spot.place, Ending.STOPPED, inner.root**2)

    def _found(self, side: float, look: Look, other: Look) -> End:
        """The end next to a place that is as good as it."""
        if not look.spot.settled:
            return self._jump(other, look)
        slope = look.slope(other)
        correction = (1 - look.root) / slope if slope > 0 else 0.0
        return End(look.spot.place + side * correction, Ending.FOUND, 1.0)

    @staticmethod
    def _levels_off(before: Look, bracket: Bracket, room: float) -> bool:
        """Whether the rise would stay allowed all the way, but for numbers that cannot be told any more out there."""
        inner = bracket.inner
        if math.isfinite(bracket.outer.root) or not inner.distance > 0:
            return False
        return inner.root + inner.slope(before) * (room - inner.distance) < 1

    def _jump(self, inner: Look, outer: Look) -> End:
        """The end where the sum of squares leaps from below to above."""
        if not self.answers(outer.spot.vector):
            return End(inner.spot.place, Ending.LOST, inner.root**2)
        return End(inner.spot.place, Ending.FOUND if outer.spot.settled else Ending.STOPPED, inner.root**2)

    def _look(self, side: float, distance: float, *known: Look) -> Look:
        """The profile at a distance from the estimate. known: places nearby, whose vectors are starts."""
        asked = distance + known[-1].lag
        place = self.center.place + side * asked
        nearest = [look.spot for look in known]
        starts = [spot.vector + (place - spot.place) * self.allowance.tangent for spot in nearest]
        if known[0].distance > 0:
            # On along the profile, as it went so far.
            first, last = self.center, known[0].spot
            share = (place - last.place) / (last.place - first.place)
            starts.append(last.vector + share * (last.vector - first.vector))
        spot = self._least(place, [*starts, *(spot.vector for spot in nearest)])
        if self.wary or not spot.settled or spot.loss >= self.center.loss + self.allowance.rise:
            # Nothing counts as outside before another start has come to the same.
            again = self._least(place, [self.lifted(spot.vector)])
            if again.loss < spot.loss or (again.settled and again.loss <= spot.loss):
                spot = again
        rise = (spot.loss - self.center.loss) / self.allowance.rise
        if spot.loss < (1 - SAME) * self.center.loss - LOWER * self.allowance.rise:
            raise BetterFitError(spot.vector)
        came = side * (spot.place - self.center.place)
        return Look(came, math.sqrt(max(rise, 0.0)), asked - came, spot)

    def _least(self, place: float, starts: list[Tensor]) -> Spot:
        return self.line.least(self.squares, place, starts, self.allowance.rise, self.reach)


# What should be known of a profile interval, in words.

# A rise of less than this share of what an interval allows is none: the profile is flat.
FLAT = 1e-4
# Parameters that a sentence lists.
MOST_SHOWN = 8

# Of all intervals of a fit.
WEIGHTS = "Profile intervals are for physical parameters: a network's weights keep their normal ones."
NETWORK = "Profile intervals are about a least sum of squares, and a network's fit stops before it: these are normal."
EXACT = "The model fits these rows to the last digit, and a profile would show rounding: these are normal intervals."
SHARED = "Too few kinematic states tell how the readings scatter: these are normal intervals."
SEVERAL = "The profiles met one better fit after the other, so the fit is none to rely on: these are normal intervals."
# Of one.
UNTOLD = "these kinematic states do not tell its scatter"

# Endings that the rows tell.
_TOLD = {Ending.FOUND, Ending.LOST}


def beside(fitted: float, least: float, values: Mapping[str, float]) -> str:
    """That the fit ended a little above the minimum. fitted, least: sums of squares; values: at the minimum, in SI."""
    return f"{_elsewhere(fitted, least, values)}. The profile intervals are about that."


def elsewhere(fitted: float, least: float, values: Mapping[str, float]) -> str:
    """That the fit ended so far above the minimum that no interval is about it."""
    return f"{_elsewhere(fitted, least, values)}. Fit again, from there or by another fit: these are normal intervals."


def _elsewhere(fitted: float, least: float, values: Mapping[str, float]) -> str:
    shown = ", ".join(f"{name} = {value:.5g}" for name, value in list(values.items())[:MOST_SHOWN])
    shown += f" and {len(values) - MOST_SHOWN} more" if len(values) > MOST_SHOWN else ""
    return f"The fit ended at a sum of squares of {fitted:.6g}, but the least is {least:.6g}, at {shown}"


def kept(reason: str) -> str:
    """Why an interval is the normal one."""
    return f"{reason}, so this is the normal interval"


def stopped(which: str, value: float, unit: str) -> str:
    """That a search did not come to an end. which: upper or lower; value: how far it came."""
    return f"the search for its {which} end did not finish (it came to {quantity(value, unit)})"


def away(value: float, unit: str) -> str:
    """That the fit's value is outside the interval. value: at the minimum."""
    return f"the least sum of squares is far from the fit, at {quantity(value, unit)}"


def about(value: float, unit: str) -> str:
    """That the interval is about another value than the fit's. value: at the minimum."""
    return f"the interval is about {quantity(value, unit)}, where the sum of squares is least"


def interval_words(low: End, high: End, ends: tuple[float, float], spec: Parameter) -> str:
    """What should be known of an interval with these ends; "" where both were found. ends: in the parameter's unit."""
    if low.ending not in _TOLD and high.ending not in _TOLD:
        if max(low.rise, high.rise) < FLAT:
            return "the rows do not determine it: every value allowed fits equally well"
        return "the rows do not determine it: no value allowed fits clearly worse"
    said = []
    if low.ending is Ending.OPEN:
        said.append(f"only an upper limit is known: below {quantity(ends[1], spec.unit)}")
    if high.ending is Ending.OPEN:
        said.append(f"only a lower limit is known: above {quantity(ends[0], spec.unit)}")
    for end, value in zip((low, high), ends, strict=True):
        if end.ending is Ending.BOUND:
            said.append(f"its interval ends at the bound {quantity(value, spec.unit)}")
        if end.ending is Ending.LOST:
            said.append(f"its interval ends at {quantity(value, spec.unit)}, beyond which rows lose their prediction")
    return "; ".join(said)


def quantity(value: float, unit: str) -> str:
    """A value with its unit, which a pure number does not show.

    >>> quantity(32345.0, "Pa"), quantity(0.0, "1")
    ('3.23e+04 Pa', '0')
    """
    return f"{value:.3g}" if unit in ("", "1") else f"{value:.3g} {unit}"
