"""A length that is not the reference length when the bed says so."""

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import BoundaryEffect


class Offset(Parameters):
    """length: imposed minus read."""

    length: Tensor = parameter(
        "l₀",
        "m",
        start=0.0,
        lower=-1e-2,
        upper=1e-2,
        none=0.0,
        per_sample=True,
        scale=1e-3,
        prior=Prior(0.0, 1.5e-3, "lengths set by hand; linear tolerances: ISO 2768-c"),
    )


class LengthOffset(BoundaryEffect[Offset]):
    """l imposed = l read + l₀ (mounting error of the linear stage)."""

    name = "length_offset"
    place = 1
    suspect = "The force curves of a sample are shifted along the elongation axis."
    source = "zero error of a position sensor: GUM (JCGM 100:2008)"
    parameter_class = Offset

    def impose(self, states: States, p: Offset) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(length=states.length + p.length)
