"""A length that is not the reference length when the bed says so."""

from types import SimpleNamespace

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class LengthOffset(Effect):
    """l imposed = l read + l₀ (mounting error of the linear stage)."""

    name = "length_offset"
    suspect = "The force curves of a sample are shifted along the elongation axis."
    source = "zero error of a position sensor: GUM (JCGM 100:2008)"
    parameters = (
        Parameter("length", "l₀", "m", start=0.0, lower=-1e-2, upper=1e-2, none=0.0, per_sample=True, scale=1e-3),
    )

    def impose(self, states: States, p: SimpleNamespace) -> States:
        return states.replace(length=states.length + p.length)
