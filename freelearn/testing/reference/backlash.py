"""Play and dry friction: contact on either side of a gap, an actuator that turns to rest, and zeros of functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

# Zeros of many functions of one variable at once.

Array = np.ndarray[Any, Any]
MOST = 100


def bracketed_zero(function: Callable[[Array], Array], low: Array, high: Array, tolerance: float) -> Array:
    """Where functions (N,) → (N,) vanish between low, where they are below zero, and high, where they are above: (N,).

    Chandrupatla (1997): inverse quadratic interpolation where the last three points bend little, else halving. NaN
    counts as above zero. Ends once every bracket is within tolerance times its first width, or its value is zero.
    """

    def value(at: Array) -> Array:
        found = function(at)
        return np.where(np.isnan(found), np.inf, found)

    # The latest point, the other end of its bracket, and the one before.
    x1, x2 = high.astype(float), low.astype(float)
    f1, f2 = value(x1), value(x2)
    done = (f1 == 0) | (f2 == 0)
    share, close = np.where(done, 0.0, 0.5), tolerance * np.abs(high - low)
    for _ in range(MOST):
        x = x1 + share * (x2 - x1)
        f = value(x)
        same = (f > 0) == (f1 > 0)
        x3, f3 = np.where(same, x1, x2), np.where(same, f1, f2)
        x2, f2 = np.where(same | done, x2, x1), np.where(same | done, f2, f1)
        x1, f1 = np.where(done, x1, x), np.where(done, f1, f)
        with np.errstate(invalid="ignore", divide="ignore"):
            least = close / np.abs(x2 - x1)
            done |= (f1 == 0) | ~(least < 0.5)
            if done.all():
                break
            place, level = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2)
            smooth = (level**2 < place) & ((1 - level) ** 2 < 1 - place)
            bent = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        share = np.clip(np.where(smooth & np.isfinite(bent), bent, 0.5), least, 1 - least)
        share = np.where(done, 0.0, share)
    return np.where(np.abs(f1) <= np.abs(f2), x1, x2)


def rubbed(pressure: Array, first: Array, sliding: float, carried: bool = False, vented: bool = False) -> Array:
    """Share of the Coulomb friction that acts at each row, (N,) in −1 … 1, positive against rising pressure.

    The element of Dahl (1968), dz/dP = (1 − z sign(dP/dt))/P_s, integrated exactly over each step of pressure.
    pressure: (N,) Pa in time order. sliding: P_s [Pa], over which friction builds up; first: (N,) bool, a kinematic
    state's first row. There the contacts begin afresh, because the move to the state slides them further, and in
    directions that the pressure does not tell; carried: the move changes nothing, only the pressure counts; vented:
    nothing presses during the move, and the first row is filled from there.
    """
    share = np.zeros(len(pressure))
    for row in range(1, len(pressure)):
        if first[row] and not carried and not vented:
            continue
        step = pressure[row] if first[row] and vented else pressure[row] - pressure[row - 1]
        side = np.sign(step)
        before = 0.0 if first[row] and vented else share[row - 1]
        share[row] = side + (before - side) * np.exp(-abs(step) / sliding)
    return share


# Play between actuator and rig: contact on either side of a gap, and an actuator that turns to its rest.

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
