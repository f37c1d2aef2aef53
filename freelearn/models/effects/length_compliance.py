"""A mount that gives way along the axis."""

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import MountEffect


class Spring(Parameters):
    """compliance: elongation for each newton."""

    compliance: Tensor = parameter(
        "c_l",
        "m/N",
        start=1e-6,
        lower=0.0,
        upper=1e-2,
        none=0.0,
        scale=2e-5,
        prior=Prior(0.0, 3e-5, "load cells and frames: some 30 N/mm and stiffer"),
    )


class LengthCompliance(MountEffect[Spring]):
    """l = l read + c F: an actuator that pushes outward (F > 0) lengthens, because the mount yields to it."""

    name = "length_compliance"
    place = 4
    suspect = "The actuator seems too soft in stretch where the force is large: load cell, stage or adhesive gives way."
    source = "machine compliance: Huerta & Malvern (1979)"
    parameter_class = Spring

    def impose(self, states: States, loads: Tensor, p: Spring) -> States:
        """As MountEffect.impose."""
        return states.replace(length=states.length + p.compliance * loads[..., 0])
