"""Friction of fibers against the bed's own motion, where the pressure is held and the place is driven."""

import torch
from torch import Tensor

from freelearn.data.moves import moved_by
from freelearn.data.states import States
from freelearn.physics.chain.ports import DissipationEffect, columns
from freelearn.physics.effects.dissipation.friction_hysteresis import Friction


class MotionFriction(DissipationEffect[Friction]):
    """F less F_f sign(Δl), M less M_f sign(Δφ), until the pressure changes.

    Δl and Δφ are how far the bed went to the state: pulled longer under a constant pressure an actuator pulls by F_f
    more, let go by as much less. Once the pressure has changed in a state the threads slide as it drives them, which is
    `friction_hysteresis`.
    """

    name = "motion_friction"
    place = 1
    suspect = "Under one pressure the loads differ between going to a length or twist from either side."
    source = "Coulomb friction of McKibben muscles in isobaric cycles: Chou & Hannaford (1996)"
    # Where the place is imposed.
    beds = ("kinematic", "isometric", "inflation")
    parameter_class = Friction
    loose = 0.01

    def dissipate(self, loads: Tensor, states: States, p: Friction) -> Tensor:
        """As DissipationEffect.dissipate."""
        way = torch.where((states.direction == 0)[:, None], moved_by(states), 0.0)
        return loads - way * columns(p.force, p.moment)
