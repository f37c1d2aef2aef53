"""A pressure gauge with a wrong sensitivity, or pressure lost on the way."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import BoundaryEffect


class Gain(Parameters):
    """gain: relative error of the gauge."""

    gain: Tensor = parameter(
        "g",
        "1",
        start=0.0,
        lower=-0.5,
        upper=0.5,
        none=0.0,
        scale=0.05,
        per_member=True,
        prior=Prior(0.0, 0.05, "pressure gauges' data sheets: span"),
    )


class PressureGain(BoundaryEffect[Gain]):
    """P acting = (1 + g) P read. Of several actuators on one end block each has its own, drawn towards a common one."""

    name = "pressure_gain"
    place = 7
    suspect = "The misfit grows in proportion to the pressure, in every sample alike."
    source = "sensitivity error of a sensor: GUM (JCGM 100:2008)"
    parameter_class = Gain

    def impose(self, states: States, p: Gain) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(pressure=states.pressure * (1 + p.gain))
