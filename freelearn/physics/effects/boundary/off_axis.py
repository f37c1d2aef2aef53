"""An actuator that stands beside the axis about which the end block turns."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import BoundaryEffect


class Place(Parameters):
    """squared_distance: of the actuator from the end block's axis. 1e-4 m² is d = √(d²) = 10 mm. Squared, because that
    is what the loads follow from nothing on."""

    squared_distance: Tensor = parameter(
        "d²",
        "m²",
        start=0.0,
        lower=0.0,
        upper=1e-2,
        none=0.0,
        scale=1e-4,
        per_member=True,
        prior=Prior(0.0, 5e-4, "end blocks of some 20 mm radius"),
    )


class OffAxis(BoundaryEffect[Place]):
    """l imposed = √(l² + 2 d² (1 − cos φ)): the actuator leans as the block turns.

    By virtual work its force f loads the block with F = f l/l imposed and M = m + f d² sin φ/l imposed. It bends and
    tilts besides, which is neglected here, and twists by φ about its own axis.
    """

    name = "off_axis"
    place = 3
    suspect = "The moment grows with the force wherever the end block is turned, more so the farther."
    source = "virtual work on a leaning link: Bruder et al. (2018), IEEE Robot. Autom. Lett. 3(4)"
    parameter_class = Place

    def impose(self, states: States, p: Place) -> States:
        """As BoundaryEffect.impose."""
        return states.replace(length=self._length(states, p))

    def hand_on(self, loads: Tensor, states: States, p: Place) -> Tensor:
        """As BoundaryEffect.hand_on."""
        force, moment = loads.unbind(-1)
        own = self._length(states, p)
        lever = p.squared_distance * states.twist.sin() / own
        return torch.stack([force * (states.length / own), moment + force * lever], dim=-1)

    def _length(self, states: States, p: Place) -> Tensor:
        leaning = 2 * p.squared_distance * (1 - states.twist.cos())
        # √(l² + leaning), written so that it is l to the last bit where nothing leans.
        return states.length + leaning / ((states.length.square() + leaning).sqrt() + states.length)
