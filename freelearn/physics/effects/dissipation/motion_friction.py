"""Friction of fibers against the bed's own motion, where the pressure is held and the place is driven."""

import torch
from torch import Tensor

from freelearn.data.moves import moved_by
from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import DissipationEffect, columns


class Rubbing(Parameters):
    """force, moment: against the last move of the length and of the twist."""

    force: Tensor = parameter(
        "F_m",
        "N",
        start=0.0,
        none=0.0,
        scale=0.5,
        per_sample=True,
        prior=Prior(0.0, 0.05, "Chou & Hannaford (1996): 2.5 N of some 100 N; Tondu & Lopez (2000)", of="force"),
    )
    moment: Tensor = parameter(
        "M_m",
        "N·m",
        start=0.0,
        none=0.0,
        scale=5e-3,
        per_sample=True,
        prior=Prior(0.0, 0.05, "as its force: Tondu & Lopez (2000)", of="moment"),
    )


class MotionFriction(DissipationEffect[Rubbing]):
    """F less F_m sign(Δl), M less M_m sign(Δφ), until the pressure changes.

    Δl and Δφ are how far the bed went to the state: pulled longer under a constant pressure an actuator pulls by F_m
    more, let go by as much less. Once the pressure has changed in a state the threads slide as it drives them, which is
    `friction_hysteresis`.
    """

    name = "motion_friction"
    place = 1
    suspect = "Under one pressure the loads differ between going to a length or twist from either side."
    source = "Coulomb friction of McKibben muscles in isobaric cycles: Chou & Hannaford (1996)"
    # Where the place is imposed.
    beds = ("kinematic", "isometric", "inflation")
    parameter_class = Rubbing
    loose = 0.01

    def dissipate(self, loads: Tensor, states: States, p: Rubbing) -> Tensor:
        """As DissipationEffect.dissipate."""
        way = torch.where((states.direction == 0)[:, None], moved_by(states), 0.0)
        return loads - way * columns(p.force, p.moment)
