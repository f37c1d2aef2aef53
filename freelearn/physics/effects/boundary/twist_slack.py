"""Backlash between the rotational servo and the actuator."""

from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import PlayEffect


class Play(Parameters):
    """angle: half the width of the band."""

    angle: Tensor = parameter(
        "w",
        "rad",
        start=0.02,
        lower=0.0,
        upper=1.0,
        none=0.0,
        per_sample=True,
        scale=0.1,
        prior=Prior(0.0, 0.09, "couplings and keys have play of up to 5°: Nordin & Gutman (2002)"),
    )


class TwistSlack(PlayEffect[Play]):
    """φ lies within φ read ± w, where the actuator's own moment is nearest zero (see play).

    Its own moment is the one that it hands on, wall, fluid and friction together.
    """

    name = "twist_slack"
    place = 3
    suspect = "The moment hardly changes around zero twist: a coupling or a key has play."
    source = "backlash as a dead zone: Nordin & Gutman (2002)"
    parameter_class = Play
    loose = 0.03
    # Within the band no moment holds the twist: under a dead load it could be any.
    beds = ("kinematic", "isometric", "inflation")

    def play(self, states: States, p: Play) -> Tensor:
        """As PlayEffect.play."""
        return p.angle
