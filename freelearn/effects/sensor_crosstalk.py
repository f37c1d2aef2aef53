"""Load cells that feel each other's load."""

from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.effects.base import Effect
from freelearn.models.parameter import Parameter


class SensorCrosstalk(Effect):
    """F shown = F + a M, M shown = M + b F (the paper's Section "Testing Protocol": a = 3.43 N/N·m, b = 6e-4 N·m/N)."""

    name = "sensor_crosstalk"
    parameters = (
        Parameter("moment_into_force", "a", "N/(N·m)", start=0.0, none=0.0),
        Parameter("force_into_moment", "b", "N·m/N", start=0.0, none=0.0),
    )

    def sense(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        force, moment = loads.unbind(-1)
        shown = (force + p.moment_into_force * moment, moment + p.force_into_moment * force)
        return torch.stack(shown, dim=-1)
