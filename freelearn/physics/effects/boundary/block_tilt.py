"""An end block that tilts as the actuators around its axis push unequally."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import TiltEffect


class Tilt(Parameters):
    """compliance: how far an actuator is lifted for each newton of its own; C_θ R², C_θ the block's in tilt."""

    compliance: Tensor = parameter(
        "c_t",
        "m/N",
        start=1e-6,
        lower=0.0,
        upper=1e-2,
        none=0.0,
        scale=2e-5,
        prior=Prior(0.0, 5e-5, "blocks 20 mm off the axis on guides of some 10 N·m/rad and stiffer"),
    )


class BlockTilt(TiltEffect[Tilt]):
    """l of actuator i = l + c Σ_j cos(β_i − β_j) f_j: what pushes harder than the others lengthens, and they shorten.

    The actuators stand evenly about the axis, β = 2π i/k in their order, all at one distance; what holds the block,
    their own bending included, resists tilts in proportion. Three share it as l + (3c/2) (f_i − mean f). The block's
    elongation is that of its middle; sideways it does not move. One actuator alone cannot tell it from a mount that
    gives way (length_compliance).
    """

    name = "block_tilt"
    place = 3
    suspect = "Several actuators push against each other on one block, and less than each alone: the block tilts."
    source = "virtual work on a tilting platform: Black, Till & Rucker (2018), parallel continuum robots"
    parameter_class = Tilt

    def tilt(self, states: States, p: Tilt) -> Tensor:
        """As TiltEffect.tilt."""
        return p.compliance
