"""Which place of a profile is looked at next, on the way to the end of an interval."""

from __future__ import annotations

import math
from dataclasses import dataclass

from freelearn.fitting.profile_line import Spot

# An end is found where the root of the rise is this near to its goal, as a share.
NEAR = 1e-5
# A jump of the sum of squares is an end too: the places before and behind it are then this near, as a share of the way.
NARROW = 1e-6
# A search that has not passed the end yet goes this many times the way that seems to be left: an end between two places
# is found sooner than one that is only come nearer to. On flat ground it goes at most FARTHEST times as far as before.
BEYOND, FARTHEST = 1.1, 4.0
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
    return now.distance + min(max(left, least), (FARTHEST - 1) * now.distance)


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
