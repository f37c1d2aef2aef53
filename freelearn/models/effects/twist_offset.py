"""A twist that is not zero when the bed says zero."""

from types import SimpleNamespace

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class TwistOffset(Effect):
    """φ imposed = φ read + φ₀ (mounting error of the rotational servo)."""

    name = "twist_offset"
    suspect = "The moment curves of a sample are shifted along the twist axis."
    source = "zero error of a position sensor: GUM (JCGM 100:2008)"
    parameters = (
        Parameter("angle", "φ₀", "rad", start=0.0, lower=-1.0, upper=1.0, none=0.0, per_sample=True, scale=0.1),
    )

    def impose(self, states: States, p: SimpleNamespace) -> States:
        return states.replace(twist=states.twist + p.angle)
