"""Ends tied to their fittings: a shorter part of the tube does all the deforming."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import GeometryEffect


class Clamps(Parameters):
    """clamp_length: at each end."""

    clamp_length: Tensor = parameter(
        "c",
        "m",
        start=2e-3,
        lower=0.0,
        upper=2e-2,
        none=0.0,
        scale=2e-3,
        prior=Prior(0.0, 6e-3, "hose clamps and plugs: 5 to 15 mm each"),
    )


class EndClamps(GeometryEffect[Clamps]):
    """A length c at each end is clamped: L and l both shrink by 2c, so stretch and twist rate grow.

    Fittings that are counted in the table's length are the same: what neither stretches nor turns is no actuator.
    """

    name = "end_clamps"
    place = 3
    suspect = "The sample is too stiff in stretch and twist alike; its ends are glued or clamped over a visible length."
    source = "Tondu & Lopez (2000), end fittings of McKibben actuators"
    parameter_class = Clamps

    def reshape(self, states: States, p: Clamps) -> States:
        """As GeometryEffect.reshape."""
        clamped = 2 * p.clamp_length
        return states.replace(reference_length=states.reference_length - clamped, length=states.length - clamped)
