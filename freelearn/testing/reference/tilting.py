"""Actuators around the axis of an end block that tilts on a spring, from the moments about its two axes across.

Written in the block's two angles and the places at which the actuators stand, where the package knows neither.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from freelearn.testing.reference.bed import Array, Effects, bed_loads

# Rounds until angles and pushes agree; each leaves less than a half of what the last one did.
ROUNDS, SETTLED = 80, 1e-13


def block_loads(
    members: Sequence[dict[str, Array]], c1: float, c2: float, fx: Effects, distance: float, angle_per_moment: float
) -> tuple[Array, Array]:
    """Loads (N, 2) on the block, and its two angles (N, 2) rad.

    members: the states of each, which stand evenly about the axis in their order. distance: of each from it [m].
    angle_per_moment: of the block's spring [rad/(N·m)].
    """
    around = 2 * np.pi * np.arange(len(members)) / len(members)
    places = distance * np.stack([np.cos(around), np.sin(around)], axis=1)
    angles = np.zeros((len(members[0]["length"]), 2))
    for _ in range(ROUNDS):
        each = [
            bed_loads(s | {"length": s["length"] + angles @ place}, c1, c2, fx)[0]
            for s, place in zip(members, places, strict=True)
        ]
        moments = sum(loads[:, :1] * place for loads, place in zip(each, places, strict=True))
        before, angles = angles, np.asarray(angle_per_moment * moments)
        if np.abs(angles - before).max() < SETTLED:
            break
    return np.asarray(sum(each)), angles
