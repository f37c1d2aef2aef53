"""Load cells that feel each other's load."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import MeasurementEffect, columns


class Crosstalk(Parameters):
    """What of each load shows in the other."""

    moment_into_force: Tensor = parameter(
        "a",
        "N/(N·m)",
        start=0.0,
        lower=-100.0,
        upper=100.0,
        none=0.0,
        scale=3.43,
        prior=Prior(0.0, 4.0, "the paper's cells: 3.43 N/(N·m)"),
    )
    force_into_moment: Tensor = parameter(
        "b",
        "N·m/N",
        start=0.0,
        lower=-0.1,
        upper=0.1,
        none=0.0,
        scale=6e-4,
        prior=Prior(0.0, 1e-3, "the paper's cells: 6e-4 N·m/N"),
    )


class SensorCrosstalk(MeasurementEffect[Crosstalk]):
    """F shown = F + a M, M shown = M + b F (the paper's cells: a = 3.43 N/(N·m), b = 6e-4 N·m/N)."""

    name = "sensor_crosstalk"
    place = 7
    suspect = "The force follows the moment, or the moment the force, where the model sees no reason."
    source = 'the paper\'s Section "Testing Protocol"'
    parameter_class = Crosstalk

    def sense(self, loads: Tensor, states: States, p: Crosstalk) -> Tensor:
        """As MeasurementEffect.sense."""
        force, moment = loads.unbind(-1)
        return columns(force + p.moment_into_force * moment, moment + p.force_into_moment * force)
