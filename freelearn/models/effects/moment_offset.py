"""A moment sensor that is not zero at rest."""

from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, columns


class MomentOffset(Effect):
    """M shown = M + M₀."""

    name = "moment_offset"
    suspect = "All moments are off by the same amount, at every state and pressure."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameters = (Parameter("moment", "M₀", "N·m", start=0.0, lower=-10.0, upper=10.0, none=0.0, scale=5e-3),)

    def sense(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        return loads + columns(torch.zeros_like(p.moment), p.moment)
