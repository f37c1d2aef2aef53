"""A pressure gauge that is not zero in the atmosphere."""

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Prior
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import BoundaryEffect


class Offset(Parameters):
    """pressure: acting minus read."""

    pressure: Tensor = parameter(
        "P₀",
        "Pa",
        start=0.0,
        lower=-5e4,
        upper=5e4,
        none=0.0,
        scale=5e3,
        per_member=True,
        prior=Prior(0.0, 5e3, "pressure gauges' data sheets: 1 % of 500 kPa"),
    )


class PressureOffset(BoundaryEffect[Offset]):
    """P acting = P read + P₀."""

    name = "pressure_offset"
    place = 6
    suspect = "Loads at zero pressure are off in the direction in which pressure moves them."
    source = "zero error of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Offset

    def impose(self, states: States, p: Offset) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(pressure=states.pressure + p.pressure)
