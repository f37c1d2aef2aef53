"""Walls that lag behind the moves of the bed: linear viscoelasticity, by Boltzmann's superposition of all of them.

The wall's own loads follow a standard linear solid: each change of them that a move brings is larger by the share g at
first, and that share of it decays with e^(−t/τ) from then on, whatever comes after (Boltzmann 1874; Christensen 1982).
Before its first state the wall has rested there for long. The fluid's pressure does not lag.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Effects = Mapping[str, Mapping[str, float]]


def overstress(wall: Array, sample: Array, clock: Array, share: float, time: float) -> Array:
    """Loads (N, 2) beside the elastic ones, of rows in time order.

    wall: the wall's own elastic loads (N, 2) at each row's place; sample, clock [s]: (N,). share g, time τ [s].
    """
    beside = np.zeros_like(wall)
    for number in dict.fromkeys(sample):
        rows = sample == number
        steps = np.diff(wall[rows], axis=0, prepend=wall[rows][:1])
        age = np.maximum(clock[rows][:, None] - clock[rows][None, :], 0.0)
        beside[rows] = share * np.tril(np.exp(-age / time)) @ steps
    return beside


def moves(s: Mapping[str, Array]) -> tuple[Array, Array]:
    """By how much length [m] and twist [rad], (N,) each, the bed moved to each row's state from the sample's last.

    s: sample, dwell (zero in a state's first row), length and twist, (N,) in time order.
    """
    length, twist = np.zeros(len(s["dwell"])), np.zeros(len(s["dwell"]))
    last: dict[float, tuple[float, float]] = {}
    now: dict[float, tuple[float, float]] = {}
    for row, number in enumerate(s["sample"]):
        place = float(s["length"][row]), float(s["twist"][row])
        if s["dwell"][row] == 0:
            last[number] = now.get(number, place)
            now[number] = place
        length[row], twist[row] = (np.array(now[number]) - last[number]).tolist()
    return length, twist


def moved_on(s: dict[str, Array], fx: Effects) -> dict[str, Array]:
    """The package's form: the whole actuator stands a share of its last move further on, and comes back."""
    p = fx.get("viscoelasticity")
    if p is None:
        return s
    left = p["share"] * np.exp(-s["dwell"] / p["time"])
    return s | {
        "length": s["length"] + left * s["moved_length"],
        "twist": s["twist"] + left * s["moved_twist"],
    }
