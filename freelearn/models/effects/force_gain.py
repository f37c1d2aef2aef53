"""A force sensor with a wrong sensitivity."""

from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, columns


class ForceGain(Effect):
    """F shown = (1 + g) F."""

    name = "force_gain"
    suspect = "All forces are off by the same share, and the moments are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameters = (Parameter("gain", "g_F", "1", start=0.0, lower=-0.95, upper=5.0, none=0.0, scale=0.05),)

    def sense(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        return loads * columns(1 + p.gain, torch.ones_like(p.gain))
