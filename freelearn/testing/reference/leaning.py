"""An actuator between two pivots that stand beside the axis about which the end block turns, as geometry alone.

Nothing but the distance between the pivots is written down; what the block feels follows by virtual work from its
numerical derivatives (complex steps).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Effects = Mapping[str, Mapping[str, float]]
STEP = 1e-30


def pivots_apart(length: Array, twist: Array, distance: float) -> Array:
    """Distance (N,) m between a pivot on the base and one on the block, a length above it and turned by the twist.

    distance: of both from the axis [m]. length, twist: (N,) m, rad, may be complex.
    """
    foot = np.stack([distance + 0 * twist, 0 * twist, 0 * length])
    head = np.stack([distance * np.cos(twist), distance * np.sin(twist), length])
    return np.asarray(np.sqrt(((head - foot) ** 2).sum(0)))


def distance_of(fx: Effects) -> float:
    """The distance that is hidden [m]."""
    return float(np.sqrt(fx.get("off_axis", {}).get("squared_distance", 0.0)))


def leaned(s: dict[str, Array], fx: Effects) -> dict[str, Array]:
    """The states that the actuators take, where the block takes these."""
    distance = distance_of(fx)
    return s | {"length": pivots_apart(s["length"], s["twist"], distance)} if distance else s


def on_the_block(loads: Array, s: dict[str, Array], fx: Effects) -> Array:
    """Loads on the block (N, 2) of actuators that push and turn with these, the block at the states s."""
    distance = distance_of(fx)
    if not distance:
        return loads
    along, turning = loads.T
    longer = pivots_apart(s["length"] + 1j * STEP, s["twist"] + 0j, distance).imag / STEP
    round_ = pivots_apart(s["length"] + 0j, s["twist"] + 1j * STEP, distance).imag / STEP
    return np.stack([along * longer, turning + along * round_], axis=1)
