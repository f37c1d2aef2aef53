"""Rubber that remembers where it was: after each move of the bed its wall lags behind."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import BoundaryEffect


class Branch(Parameters):
    """share: of the wall's stiffness that relaxes; time: in which all but 1/e of an overstress is gone."""

    share: Tensor = parameter(
        "g",
        "1",
        start=0.1,
        lower=0.0,
        upper=2.0,
        none=0.0,
        scale=0.1,
        prior=Prior(0.0, 0.2, "rubbers lose a tenth to a fifth in minutes: Ferry (1980)"),
    )
    time: Tensor = parameter(
        "τ",
        "s",
        start=100.0,
        lower=1.0,
        upper=1e5,
        log=True,
        scale=100.0,
        prior=Prior(100.0, 2.0, "seconds to hours: Ferry (1980)"),
    )


class Viscoelasticity(BoundaryEffect[Branch]):
    """q imposed = q read + g (q − q before) e^(−t/τ), t the time since the kinematic state q = (l, φ) was reached.

    A spring and a dashpot beside the wall (Zener's solid): where the bed has just stretched it the actuator pulls too
    much, and where it has just come back it pushes. To first order the overstress is that of a wall moved on by a share
    of the way that it came; of states that last longer than τ the last move is all that counts. `relaxation` forgets
    what was before a state.
    """

    name = "viscoelasticity"
    place = 9
    suspect = (
        "Just after a move the loads overshoot in its direction, forth and back, and settle while the state lasts."
    )
    source = "standard linear solid: Zener (1948); Christensen (1982)"
    needs = ("time_s",)
    # Where the state is imposed: under a dead load it moves all the time.
    beds = ("kinematic", "isometric", "inflation")
    parameter_class = Branch
    loose = 0.15

    def impose(self, states: States, p: Branch) -> States:
        """As BoundaryEffect.impose."""
        left = p.share * torch.exp(-states.dwell / p.time)
        return states.replace(
            length=states.length + left * states.moved_length, twist=states.twist + left * states.moved_twist
        )
