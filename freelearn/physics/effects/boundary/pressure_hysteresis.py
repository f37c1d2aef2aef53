"""A regulator or a gauge that lags behind the pressure by a constant."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import BoundaryEffect


class PressureLag(Parameters):
    """pressure: by which what acts is behind what is told, in the direction in which it changed."""

    pressure: Tensor = parameter(
        "δ",
        "Pa",
        start=0.0,
        lower=-5e4,
        upper=5e4,
        none=0.0,
        scale=1e3,
        prior=Prior(0.0, 2.5e3, "proportional regulators' data sheets: 0.5 % of 500 kPa"),
    )


class PressureHysteresis(BoundaryEffect[PressureLag]):
    """P acting = P told − δ sign(ΔP).

    A regulator whose setpoint is logged stays short of it on the way up and above it on the way down (δ > 0); a gauge
    that lags shows less than acts on the way up (δ < 0). The loads differ by what δ would make of them, so by more
    where the actuator is strong; friction takes the same everywhere.
    """

    name = "pressure_hysteresis"
    directed = True
    place = 8
    suspect = "Loads at one pressure differ between inflating and deflating, and most where pressure moves them most."
    source = "hysteresis of instruments: VIM (JCGM 200:2012) 4.29; proportional regulators' data sheets"
    parameter_class = PressureLag

    def impose(self, states: States, p: PressureLag) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(pressure=states.pressure - states.direction * p.pressure)
