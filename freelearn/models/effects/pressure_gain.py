"""A pressure gauge with a wrong sensitivity, or pressure lost on the way."""

from types import SimpleNamespace

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class PressureGain(Effect):
    """P acting = (1 + g) P read."""

    name = "pressure_gain"
    suspect = "The misfit grows in proportion to the pressure, in every sample alike."
    source = "sensitivity error of a sensor: GUM (JCGM 100:2008)"
    parameters = (Parameter("gain", "g", "1", start=0.0, lower=-0.5, upper=0.5, none=0.0, scale=0.05),)

    def impose(self, states: States, p: SimpleNamespace) -> States:
        return states.replace(pressure=states.pressure * (1 + p.gain))
