"""A twist that is not zero when the bed says zero."""

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import BoundaryEffect


class Offset(Parameters):
    """angle: imposed minus read."""

    angle: Tensor = parameter(
        "φ₀",
        "rad",
        start=0.0,
        lower=-1.0,
        upper=1.0,
        none=0.0,
        per_sample=True,
        scale=0.1,
        prior=Prior(0.0, 0.09, "mounted by eye: 5°"),
    )


class TwistOffset(BoundaryEffect[Offset]):
    """φ imposed = φ read + φ₀ (mounting error of the rotational servo)."""

    name = "twist_offset"
    place = 2
    suspect = "The moment curves of a sample are shifted along the twist axis."
    source = "zero error of a position sensor: GUM (JCGM 100:2008)"
    parameter_class = Offset

    def impose(self, states: States, p: Offset) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(twist=states.twist + p.angle)
