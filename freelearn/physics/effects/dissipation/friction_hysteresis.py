"""Friction of fibers and seals: the load lags behind the pressure."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import DissipationEffect, columns


class Friction(Parameters):
    """force, moment: against the direction of the pressure, or of the bed."""

    force: Tensor = parameter(
        "F_f",
        "N",
        start=0.0,
        none=0.0,
        scale=0.5,
        per_sample=True,
        prior=Prior(0.0, 0.05, "Tondu & Lopez (2000): 5 % of the largest force", of="force"),
    )
    moment: Tensor = parameter(
        "M_f",
        "N·m",
        start=0.0,
        none=0.0,
        scale=5e-3,
        per_sample=True,
        prior=Prior(0.0, 0.05, "as its force: Tondu & Lopez (2000)", of="moment"),
    )


class FrictionHysteresis(DissipationEffect[Friction]):
    """A constant force F_f and moment M_f against the direction in which the pressure changed.

    Both are signed: a load that falls with the pressure lags the other way. Each sample rubs on its own: how much
    depends on how taut its fibers lie.
    """

    name = "friction_hysteresis"
    directed = True
    place = 1
    suspect = "Loads at one pressure differ between inflating and deflating."
    source = "Coulomb friction as in Chou & Hannaford (1996) for McKibben muscles"
    parameter_class = Friction
    loose = 0.01

    def dissipate(self, loads: Tensor, states: States, p: Friction) -> Tensor:
        """As DissipationEffect.dissipate."""
        return loads - states.direction[:, None] * columns(p.force, p.moment)
