"""A mount that gives way in twist."""

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import MountEffect


class Spring(Parameters):
    """compliance: twist for each newton meter."""

    compliance: Tensor = parameter(
        "c_φ",
        "rad/(N·m)",
        start=1e-2,
        lower=0.0,
        upper=20.0,
        none=0.0,
        scale=0.3,
        prior=Prior(0.0, 0.3, "couplings and torque cells: some 3 N·m/rad and stiffer"),
    )


class TwistCompliance(MountEffect[Spring]):
    """φ = φ read + c M: the mount turns in the direction in which the actuator's moment drives it."""

    name = "twist_compliance"
    place = 5
    suspect = "The actuator seems too soft in twist where the moment is large: shaft, coupling or adhesive gives way."
    source = "machine compliance: Huerta & Malvern (1979)"
    parameter_class = Spring

    def impose(self, states: States, loads: Tensor, p: Spring) -> States:
        """As MountEffect.impose."""
        return states.replace(twist=states.twist + p.compliance * loads[..., 1])
