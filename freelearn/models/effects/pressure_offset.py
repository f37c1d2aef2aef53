"""A pressure gauge that is not zero in the atmosphere."""

from types import SimpleNamespace

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class PressureOffset(Effect):
    """P acting = P read + P₀."""

    name = "pressure_offset"
    suspect = "Loads at zero pressure are off in the direction in which pressure moves them."
    source = "zero error of a sensor: GUM (JCGM 100:2008)"
    parameters = (Parameter("pressure", "P₀", "Pa", start=0.0, lower=-5e4, upper=5e4, none=0.0, scale=5e3),)

    def impose(self, states: States, p: SimpleNamespace) -> States:
        return states.replace(pressure=states.pressure + p.pressure)
