"""A moment sensor that is not zero at rest."""

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import MeasurementEffect, columns


class Offset(Parameters):
    """moment: shown minus real."""

    moment: Tensor = parameter(
        "M₀",
        "N·m",
        start=0.0,
        lower=-10.0,
        upper=10.0,
        none=0.0,
        scale=5e-3,
        prior=Prior(0.0, 0.05, "torque cells' data sheets: zero balance", of="moment"),
    )


class MomentOffset(MeasurementEffect[Offset]):
    """M shown = M + M₀."""

    name = "moment_offset"
    place = 2
    suspect = "All moments are off by the same amount, at every state and pressure."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Offset
    # Other beds have no moment.
    beds = ("kinematic", "dead_load")

    def sense(self, loads: Tensor, states: States, p: Offset) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads + columns(torch.zeros_like(p.moment), p.moment)
