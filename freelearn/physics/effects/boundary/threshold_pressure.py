"""A bladder that does not touch its braid before some pressure."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import BoundaryEffect

# How sharply the loss ends: the larger, the sharper. Even, so that no sign is lost.
SHARPNESS = 12
# Pressure over which the loss builds up at least [Pa], well above what gauges err by, and from no slope at all: a
# threshold that made less of what a gauge shows in the atmosphere would be found wherever a gauge has noise.
ONSET = 1e3


class Threshold(Parameters):
    """pressure: that it takes to press the bladder on the braid."""

    pressure: Tensor = parameter(
        "P_t",
        "Pa",
        start=1e3,
        lower=0.0,
        upper=5e5,
        none=0.0,
        scale=5e3,
        per_member=True,
        prior=Prior(0.0, 2e4, "bladders of muscles: Chou & Hannaford (1996)"),
    )


class ThresholdPressure(BoundaryEffect[Threshold]):
    """P acting = P − h P P_t/(Pⁿ + P_tⁿ + w₀ⁿ)^(1/n), h = P²/(P² + w₀²), n = 12, w₀ = 1 kPa: a smooth max(P − P_t, 0).

    Far below P_t nothing acts, but half a w₀ at P = w₀; far above, P − P_t does. Neither slope, by P or by P_t, exceeds
    one. Below the pressure of the atmosphere it is the other side of a dead band. Rows without pressure tell it from
    pressure_offset, which acts there too.
    """

    name = "threshold_pressure"
    place = 8
    suspect = "Nothing happens up to some pressure, and beyond it the loads follow what exceeds it."
    source = "Chou & Hannaford (1996), threshold pressure of McKibben muscles"
    parameter_class = Threshold

    def impose(self, states: States, p: Threshold) -> States:
        """As BoundaryEffect.impose."""
        pressure = states.pressure
        powers = pressure**SHARPNESS + p.pressure**SHARPNESS + ONSET**SHARPNESS
        built_up = pressure**2 / (pressure**2 + ONSET**2)
        return states.replace(pressure=pressure - built_up * pressure * p.pressure / powers ** (1 / SHARPNESS))
