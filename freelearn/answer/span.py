"""Where answers are looked for, and where they are extrapolated."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.answer.system import System
from freelearn.measurements.beds import ELONGATION, PRESSURE
from freelearn.measurements.states import States

# Beyond what was measured an answer is looked for this far, as a share of what was gone through.
BEYOND = 0.5
# At least so much of the reference length, and so much twist [rad], is looked through on either side of rest.
LEAST_LENGTH, LEAST_TWIST = 0.1, 0.5
# As a share of the pressures gone through.
PUMP = 0.05


@dataclass(frozen=True)
class Span:
    """Least and largest value of each input, (m,): lengths in reference lengths, the others SI.

    measured: of the rows that were fitted. looked: where an answer is looked for."""

    measured: tuple[Tensor, Tensor]
    looked: tuple[Tensor, Tensor]

    @classmethod
    def of(cls, system: System) -> Span:
        """From the states that a model was fitted on."""
        x = relative(system, system.x)
        low, high = x.amin(0), x.amax(0)
        lower, upper = low.clone(), high.clone()
        for i, quantity in enumerate(system.inputs):
            room = BEYOND * (high[i] - low[i])
            if quantity is PRESSURE:
                # A pump gives hardly more than it gave, and a valve no less than what is outside: as far off as errors
                # of measuring may make an answer.
                slack = PUMP * (high[i] - low[i])
                lower[i], upper[i] = torch.clamp(low[i], max=0.0) - slack, high[i] + slack
                continue
            rest, least = (1.0, LEAST_LENGTH) if quantity is ELONGATION else (0.0, LEAST_TWIST)
            if quantity.field in ("force", "moment"):
                rest, least = 0.0, 0.0
            lower[i] = min(float(low[i] - room), rest - least)
            upper[i] = max(float(high[i] + room), rest + least)
        return cls((low, high), (lower, upper))

    def box(self, system: System) -> tuple[Tensor, Tensor]:
        """Where an answer is looked for in each row, (N, m) twice, SI."""
        size = sizes(system)
        return self.looked[0] * size, self.looked[1] * size

    def outside(self, system: System, x: Tensor, slack: Tensor) -> Tensor:
        """Inputs (N, m) beyond what was measured by more than a slack (m,) in SI: (N, m) bool."""
        size = sizes(system)
        return (x < self.measured[0] * size - slack) | (x > self.measured[1] * size + slack)


def sizes(system: System) -> Tensor:
    """What each input counts in, (N, m): the reference length for a length, one for the others."""
    states: States = system.states
    ones = torch.ones_like(states.reference_length)
    return torch.stack([states.reference_length if q is ELONGATION else ones for q in system.inputs], dim=-1)


def relative(system: System, x: Tensor) -> Tensor:
    """Inputs with lengths in reference lengths, (N, m)."""
    return x / sizes(system)
