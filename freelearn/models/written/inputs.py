"""What an effect that nobody wrote may depend on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.units import DEG, KPA, MM, NMM


@dataclass(frozen=True)
class Input:
    """A quantity of a row. code: how an effect reads it from its `states` and `loads`; unit: SI; shown, factor: the
    unit of tables, and from that to SI; symbol: in formulas."""

    name: str
    symbol: str
    code: str
    unit: str
    shown: str
    factor: float

    @property
    def of_loads(self) -> bool:
        """Whether it is one of the loads, and not of the state."""
        return self.code.startswith("loads")

    def read(self, states: States, loads: Tensor) -> Tensor:
        """Its values at N states that carry loads (N, 2): (N,) SI."""
        read = READ[self.name]
        return read(states, loads)


ELONGATION = Input("elongation", "Δl", "states.length - states.reference_length", "m", "mm", MM)
TWIST = Input("twist", "φ", "states.twist", "rad", "°", DEG)
PRESSURE = Input("pressure", "P", "states.pressure", "Pa", "kPa", KPA)
FORCE = Input("force", "F", "loads[..., 0]", "N", "N", 1.0)
MOMENT = Input("moment", "M", "loads[..., 1]", "N·m", "N·mm", NMM)
TIME = Input("time", "t", "states.clock", "s", "s", 1.0)
SEVERITY = Input("severity", "S", "states.severity", "1", "", 1.0)
# Invariants of the strain, from where they are at rest.
I1 = Input("i1", "I₁ − 3", "invariants[0] - 3", "1", "", 1.0)
I2 = Input("i2", "I₂ − 3", "invariants[0] - 3", "1", "", 1.0)
I4 = Input("i4", "I₄ − 1", "invariants[0] - 1", "1", "", 1.0)

READ: dict[str, Callable[[States, Tensor], Tensor]] = {
    "elongation": lambda states, loads: states.length - states.reference_length,
    "twist": lambda states, loads: states.twist,
    "pressure": lambda states, loads: states.pressure,
    "force": lambda states, loads: loads[..., 0],
    "moment": lambda states, loads: loads[..., 1],
    "time": lambda states, loads: states.clock,
    "severity": lambda states, loads: states.severity,
}


def round_scale(values: Tensor) -> float:
    """A number of one digit about as large as the largest of the values (…): what they are told in.

    >>> import torch
    >>> round_scale(torch.tensor([-0.0043, 0.0041]))
    0.004
    """
    largest = float(values.abs().max())
    return float(f"{largest:.0e}") if largest > 0 else 1.0
