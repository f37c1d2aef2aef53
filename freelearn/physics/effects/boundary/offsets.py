"""Lengths, twists and pressures that are not zero where the bed says so."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import BoundaryEffect


class LengthZero(Parameters):
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


class LengthOffset(BoundaryEffect[LengthZero]):
    """l imposed = l read + l₀ (mounting error of the linear stage)."""

    name = "length_offset"
    place = 1
    suspect = "The force curves of a sample are shifted along the elongation axis."
    source = "zero error of a position sensor: GUM (JCGM 100:2008)"
    parameter_class = LengthZero

    def impose(self, states: States, p: LengthZero) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(length=states.length + p.length)


class TwistZero(Parameters):
    """angle: imposed minus read."""

    angle: Tensor = parameter(
        "φ₀",
        "rad",
        start=0.0,
        lower=-1.0,
        upper=1.0,
        none=0.0,
        per_sample=True,
        scale=0.1,
        prior=Prior(0.0, 0.09, "mounted by eye: 5°"),
    )


class TwistOffset(BoundaryEffect[TwistZero]):
    """φ imposed = φ read + φ₀ (mounting error of the rotational servo)."""

    name = "twist_offset"
    place = 2
    suspect = "The moment curves of a sample are shifted along the twist axis."
    source = "zero error of a position sensor: GUM (JCGM 100:2008)"
    parameter_class = TwistZero

    def impose(self, states: States, p: TwistZero) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(twist=states.twist + p.angle)


class PressureZero(Parameters):
    """pressure: acting minus read."""

    pressure: Tensor = parameter(
        "P₀",
        "Pa",
        start=0.0,
        lower=-5e4,
        upper=5e4,
        none=0.0,
        per_sample=True,
        scale=5e3,
        per_member=True,
        prior=Prior(0.0, 5e3, "pressure gauges' data sheets: 1 % of 500 kPa"),
    )


class PressureOffset(BoundaryEffect[PressureZero]):
    """P acting = P read + P₀."""

    name = "pressure_offset"
    place = 6
    suspect = "Loads at zero pressure are off in the direction in which pressure moves them."
    source = "zero error of a sensor: GUM (JCGM 100:2008)"
    parameter_class = PressureZero

    def impose(self, states: States, p: PressureZero) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(pressure=states.pressure + p.pressure)
