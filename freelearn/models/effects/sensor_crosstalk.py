"""Load cells that feel each other's load."""

from types import SimpleNamespace

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, columns


class SensorCrosstalk(Effect):
    """F shown = F + a M, M shown = M + b F (the paper's cells: a = 3.43 N/(N·m), b = 6e-4 N·m/N)."""

    name = "sensor_crosstalk"
    suspect = "The force follows the moment, or the moment the force, where the model sees no reason."
    source = 'the paper\'s Section "Testing Protocol"'
    parameters = (
        Parameter("moment_into_force", "a", "N/(N·m)", start=0.0, lower=-100.0, upper=100.0, none=0.0, scale=3.43),
        Parameter("force_into_moment", "b", "N·m/N", start=0.0, lower=-0.1, upper=0.1, none=0.0, scale=6e-4),
    )

    def sense(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        force, moment = loads.unbind(-1)
        return columns(force + p.moment_into_force * moment, moment + p.force_into_moment * force)
