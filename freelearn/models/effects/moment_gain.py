"""A moment sensor with a wrong sensitivity."""

from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, columns


class MomentGain(Effect):
    """M shown = (1 + g) M."""

    name = "moment_gain"
    suspect = "All moments are off by the same share, and the forces are right."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameters = (Parameter("gain", "g_M", "1", start=0.0, lower=-0.95, upper=5.0, none=0.0, scale=0.05),)

    def sense(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        return loads * columns(torch.ones_like(p.gain), 1 + p.gain)
