"""Play between actuator and rig: contact on either side of a gap, and an actuator that turns to its rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from freelearn.testing.reference.zeros import bracketed_zero

Array = np.ndarray[Any, Any]
# Places across the gap at which the moment is looked at.
PLACES = 9
TOLERANCE = 1e-10


def contact(behind: Array, gap: float, stiffness: float) -> Array:
    """Moment [N·m] of the rig on the actuator, whose twist is `behind` [rad] the rig's: none within the gap."""
    return np.asarray(stiffness * (np.maximum(behind - gap, 0) + np.minimum(behind + gap, 0)))


def settled(rig: Array, sample: Array, gap: float, stiffness: float, moment: Callable[[Array], Array]) -> Array:
    """Twist (N,) rad at which the actuator of each row has come to rest.

    rig: twist of the rig (N,) in time order; gap: half of the play [rad]; stiffness: of the contact [N·m/rad]; moment:
    the actuators' own (N,) N·m at twists (N,), positive where it turns them on. An actuator stays where it was, as far
    as the gap allows, and then turns the way that moment and contact drive it to the first place at which they balance
    (the quasi-static play of Nordin & Gutman 2002, with their elastic shaft behind it). Other places of balance would
    not be reached.
    """
    share = np.linspace(-1, 1, PLACES)
    own = np.stack([moment(rig + gap * x) for x in share], axis=1)
    # Beyond the gap the contact alone ends the turning: so far that it outweighs twice the moment at the edge.
    past = 2 * np.abs(own[:, [0, -1]]) / stiffness + 1e-9
    places = np.concatenate([-gap - past[:, :1], gap * np.broadcast_to(share, own.shape), gap + past[:, 1:]], axis=1)
    drive = np.concatenate([own[:, :1] + stiffness * past[:, :1], own, own[:, -1:] - stiffness * past[:, 1:]], axis=1)
    low, high = np.empty(len(rig)), np.empty(len(rig))
    at = 0.0
    for row in range(len(rig)):
        begins = row == 0 or sample[row] != sample[row - 1]
        start = 0.0 if begins else float(np.clip(at - rig[row], -gap, gap))
        edge = _first_balance(places[row], drive[row], start)
        low[row], high[row] = places[row, edge], places[row, edge + 1]
        at = rig[row] + np.interp(0.0, -drive[row, edge : edge + 2], places[row, edge : edge + 2])

    def excess(offset: Array) -> Array:
        return -moment(rig + offset) - contact(-offset, gap, stiffness)

    return np.asarray(rig + bracketed_zero(excess, low, high, TOLERANCE))


def _first_balance(places: Array, drive: Array, start: float) -> int:
    """Interval of places in which what begins at `start` comes to rest: where the drive turns from + to −."""
    falls = np.flatnonzero((drive[:-1] > 0) & (drive[1:] <= 0))
    if np.interp(start, places, drive) > 0:
        return int(falls[places[falls + 1] > start][0])
    return int(falls[places[falls] <= start][-1])
