"""A force sensor with a wrong sensitivity."""

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import MeasurementEffect, columns


class Gain(Parameters):
    """gain: relative error of the cell."""

    gain: Tensor = parameter(
        "g_F",
        "1",
        start=0.0,
        lower=-0.95,
        upper=5.0,
        none=0.0,
        scale=0.05,
        prior=Prior(0.0, 0.05, "load cells' data sheets: span, and cells mounted askew"),
    )


class ForceGain(MeasurementEffect[Gain]):
    """F shown = (1 + g) F."""

    name = "force_gain"
    place = 3
    suspect = "All forces are off by the same share, and the moments are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Gain

    def sense(self, loads: Tensor, states: States, p: Gain) -> Tensor:
        """As MeasurementEffect.sense."""
        return loads * columns(1 + p.gain, torch.ones_like(p.gain))
