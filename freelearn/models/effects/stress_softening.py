"""Rubber that has been worked harder before is softer (Mullins effect)."""

from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, per_row


class StressSoftening(Effect):
    """Loads · (1 − d tanh((S_max − S)/m)), S the severity of the row and S_max the largest so far (see `States`).

    On the virgin path S = S_max and nothing is lost. Ogden & Roxburgh have the error function of the strain energy;
    the severity stands for it, so that a row's factor needs no history but its own inputs.
    """

    name = "stress_softening"
    suspect = "A repeated state shows lower loads once the actuator has been to a harsher one."
    source = "after Ogden & Roxburgh (1999)"
    parameters = (
        Parameter("depth", "d", "1", start=0.05, lower=0.0, upper=0.95, none=0.0, scale=0.1),
        Parameter("severity", "m", "1", start=1e-2, lower=1e-5, upper=10.0, log=True, scale=1e-2),
    )

    def dissipate(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        softened = torch.tanh((states.past_severity - states.severity) / p.severity)
        return loads * (1 - per_row(p.depth * softened))
