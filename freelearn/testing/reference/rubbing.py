"""Dry friction that first gives way elastically: what is felt of it along a path of pressures."""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]


def rubbed(pressure: Array, first: Array, sliding: float, carried: bool = False) -> Array:
    """Share of the Coulomb friction that acts at each row, (N,) in −1 … 1, positive against rising pressure.

    The element of Dahl (1968), dz/dP = (1 − z sign(dP/dt))/P_s, integrated exactly over each step of pressure.
    pressure: (N,) Pa in time order. sliding: P_s [Pa], over which friction builds up; first: (N,) bool, a kinematic
    state's first row. There the contacts begin afresh, because the move to the state slides them further, and in
    directions that the pressure does not tell; carried: the move changes nothing, only the pressure counts.
    """
    share = np.zeros(len(pressure))
    for row in range(1, len(pressure)):
        if first[row] and not carried:
            continue
        step = pressure[row] - pressure[row - 1]
        side = np.sign(step)
        share[row] = side + (share[row - 1] - side) * np.exp(-abs(step) / sliding)
    return share
