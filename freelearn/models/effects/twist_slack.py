"""Backlash between the rotational servo and the actuator."""

from types import SimpleNamespace

import torch

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class TwistSlack(Effect):
    """φ imposed = φ read − clamp(φ read, −s, s): within the dead band ±s the servo turns and nothing follows."""

    name = "twist_slack"
    suspect = "The moment hardly changes around zero twist: a coupling or a key has play."
    source = "dead-band model of backlash: Nordin & Gutman (2002)"
    parameters = (
        Parameter("angle", "s", "rad", start=0.02, lower=0.0, upper=1.0, none=0.0, per_sample=True, scale=0.1),
    )

    def impose(self, states: States, p: SimpleNamespace) -> States:
        return states.replace(twist=states.twist - torch.clamp(states.twist, -p.angle, p.angle))
