"""A force sensor that is not zero at rest."""

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import MeasurementEffect, columns


class Offset(Parameters):
    """force: shown minus real."""

    force: Tensor = parameter(
        "F₀",
        "N",
        start=0.0,
        lower=-1e3,
        upper=1e3,
        none=0.0,
        scale=0.5,
        prior=Prior(0.0, 0.05, "load cells' data sheets: zero balance", of="force"),
    )


class ForceOffset(MeasurementEffect[Offset]):
    """F shown = F + F₀."""

    name = "force_offset"
    place = 1
    suspect = "All forces are off by the same amount, at every state and pressure."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Offset

    def sense(self, loads: Tensor, states: States, p: Offset) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads + columns(p.force, torch.zeros_like(p.force))
