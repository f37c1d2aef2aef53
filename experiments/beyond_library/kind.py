"""What a kind of hidden physics is: where it enters, of what it is a function, and which function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Values = Mapping[str, Array]
Shape = Mapping[str, float]

# What one of each input is in SI: functions are of numbers of order one. Elongation in 5 mm, twist in 2 rad, pressure
# in 72.5 kPa, force in 50 N, moment in 0.3 N·m, time in 2.5 h; of the invariants what exceeds rest, in 0.1, 0.1, 0.05.
ONE = {
    **{"elongation": 5e-3, "twist": 2.0, "pressure": 72.5e3, "force": 50.0, "moment": 0.3, "time": 9e3},
    **{"i1": 0.1, "i2": 0.1, "i4": 0.05, "direction": 1.0},
}
# About where the rows of random actuators lie, in these numbers: least and most.
BOX = {
    **{"elongation": (-1.2, 1.2), "twist": (-1.0, 1.0), "pressure": (0.0, 1.0), "force": (-2.0, 2.0)},
    **{"moment": (-1.2, 1.2), "time": (0.0, 1.2), "i1": (0.0, 1.5), "i2": (0.0, 1.5), "i4": (-0.8, 0.8)},
}
# Of the places that an unknown function may enter, what stands for one of it in SI: m, rad, Pa; rad, m, m; Pa; N, N·m,
# J; N, N·m; N, N·m. A data set's amount is a multiple of these.
UNIT = {
    ("boundary", "length"): 2e-4,
    ("boundary", "twist"): 0.02,
    ("boundary", "pressure"): 1e3,
    ("geometry", "fiber_angle"): 0.01,
    ("geometry", "outer_radius"): 1e-4,
    ("geometry", "reference_length"): 5e-4,
    ("energy", "i1"): 1e3,
    ("energy", "i2"): 1e3,
    ("energy", "i4"): 1e4,
    ("parallel", "axial"): 0.1,
    ("parallel", "torsional"): 2e-3,
    ("parallel", "both"): 1e-3,
    ("dissipation", "force"): 0.1,
    ("dissipation", "moment"): 2e-3,
    ("measurement", "force"): 0.1,
    ("measurement", "moment"): 2e-3,
}
# Ports at which either sign is as natural.
SIGNED = ("boundary", "geometry", "measurement")


@dataclass(frozen=True)
class Kind:
    """One kind of physics that no effect of the library is.

    port: boundary, geometry, energy, parallel (an element beside the tube), dissipation or measurement. where: what is
    changed there, see UNIT. inputs: what it depends on. form: the family of its function. formula: for people; x̂ is x
    as a number of order one, see ONE. function: of the inputs in these numbers, and of the shape: (values, shape) →
    (N,). Of an energy it is Ψ, of a parallel element at `both` its potential, elsewhere what is added, with friction
    against the direction of the pressure's change. Where it is an energy or a potential it must bear complex numbers.
    shape: least and most of each number that a data set draws.
    """

    name: str
    port: str
    where: str
    inputs: tuple[str, ...]
    form: str
    formula: str
    function: Callable[[Values, Shape], Array]
    shape: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def unit(self) -> float:
        """What one of its function is in SI."""
        return UNIT[self.port, self.where]

    @property
    def group(self) -> str:
        """Under which its results are counted."""
        if self.port == "boundary":
            return f"boundary {self.where}"
        return f"{self.where} cell" if self.port == "measurement" else self.port

    def drawn(self, generator: np.random.Generator) -> dict[str, float]:
        """A shape of its own for a data set, its sign included."""
        shape = {name: float(generator.uniform(*ends)) for name, ends in self.shape.items()}
        sign = float(generator.choice([-1.0, 1.0])) if self.port in SIGNED else 1.0
        return shape | {"sign": sign}


def over(x: Array, edge: float = 0.0) -> Array:
    """What exceeds an edge, else zero; bears complex numbers."""
    return np.where(x.real > edge, x - edge, 0.0)
