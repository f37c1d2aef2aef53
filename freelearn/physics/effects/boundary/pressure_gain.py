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


class OwnGain(Gain):
    """gain: of a sample's pressures against the first one's; 0.1 is one whose wall got 10 % more than was read."""

    gain: Tensor = parameter(
        "g",
        "1",
        start=0.0,
        lower=-0.5,
        upper=0.5,
        none=0.0,
        scale=0.05,
        per_sample=True,
        # Each of the two 5 %, as a gain that all share; that of the first is in all ratios.
        prior=Prior(0.0, 0.07, "pressure gauges' data sheets: span, each time it is set", common=0.5),
    )


class OwnPressureGain(PressureGain):
    """P acting on sample i = (1 + gᵢ) P read; of the first g is 0, and what all share is `pressure_gain`.

    Another gauge, or another supply, for some of the samples. Actuators on one end block have it in `pressure_gain`.
    """

    name = "own_pressure_gain"
    place = 8
    compares = True
    alone = True
    suspect = "The misfit of one sample grows in proportion to the pressure, and that of the others does not."
    parameter_class = OwnGain
    # A gauge is seldom changed between the samples of one session.
    odds = 0.02
