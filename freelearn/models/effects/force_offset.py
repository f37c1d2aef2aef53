"""A force sensor that is not zero at rest."""

from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, columns


class ForceOffset(Effect):
    """F shown = F + F₀."""

    name = "force_offset"
    suspect = "All forces are off by the same amount, at every state and pressure."
    source = "zero and sensitivity errors of a sensor: GUM (JCGM 100:2008)"
    parameters = (Parameter("force", "F₀", "N", start=0.0, lower=-1e3, upper=1e3, none=0.0, scale=0.5),)

    def sense(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        return loads + columns(p.force, torch.zeros_like(p.force))
