"""A mount that gives way, along the axis or in twist."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import MountEffect


class AxialSpring(Parameters):
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


class LengthCompliance(MountEffect[AxialSpring]):
    """l = l read + c F: an actuator that pushes outward (F > 0) lengthens, because the mount yields to it."""

    name = "length_compliance"
    place = 4
    suspect = "The actuator seems too soft in stretch where the force is large: load cell, stage or adhesive gives way."
    source = "machine compliance: Huerta & Malvern (1979)"
    parameter_class = AxialSpring

    def impose(self, states: States, loads: Tensor, p: AxialSpring) -> States:
        """As MountEffect.impose."""
        return states.replace(length=states.length + p.compliance * loads[..., 0])


class TorsionSpring(Parameters):
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


class TwistCompliance(MountEffect[TorsionSpring]):
    """φ = φ read + c M: the mount turns in the direction in which the actuator's moment drives it."""

    name = "twist_compliance"
    place = 5
    suspect = "The actuator seems too soft in twist where the moment is large: shaft, coupling or adhesive gives way."
    source = "machine compliance: Huerta & Malvern (1979)"
    parameter_class = TorsionSpring

    def impose(self, states: States, loads: Tensor, p: TorsionSpring) -> States:
        """As MountEffect.impose."""
        return states.replace(twist=states.twist + p.compliance * loads[..., 1])
