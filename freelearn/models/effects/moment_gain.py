"""A moment sensor with a wrong sensitivity."""

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import MeasurementEffect, columns


class Gain(Parameters):
    """gain: relative error of the cell."""

    gain: Tensor = parameter(
        "g_M",
        "1",
        start=0.0,
        lower=-0.95,
        upper=5.0,
        none=0.0,
        scale=0.05,
        prior=Prior(0.0, 0.05, "torque cells' data sheets: span, and cells mounted askew"),
    )


class MomentGain(MeasurementEffect[Gain]):
    """M shown = (1 + g) M."""

    name = "moment_gain"
    place = 4
    suspect = "All moments are off by the same share, and the forces are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Gain
    # Other beds have no moment.
    beds = ("kinematic", "dead_load")

    def sense(self, loads: Tensor, states: States, p: Gain) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads * columns(torch.ones_like(p.gain), 1 + p.gain)
