"""Fibers wound at another angle than the drawing says."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import GeometryEffect


class Misalignment(Parameters):
    """angle: built minus drawn."""

    angle: Tensor = parameter(
        "ΔΓ",
        "rad",
        start=0.0,
        lower=-0.2,
        upper=0.2,
        none=0.0,
        per_sample=True,
        scale=0.02,
        prior=Prior(0.0, 0.05, "winding by hand, 3°: Bruder et al. (2018)"),
    )


class FiberMisalignment(GeometryEffect[Misalignment]):
    """Γ built = Γ + ΔΓ (Bruder et al. 2018 blame fabrication tolerance; the paper's Section on samples)."""

    name = "fiber_misalignment"
    place = 1
    suspect = "One sample is off as if it had a neighbor's fiber angle."
    source = "Bruder et al. (2018), fabrication tolerance"
    parameter_class = Misalignment

    def reshape(self, states: States, p: Misalignment) -> States:
        """As GeometryEffect.reshape."""
        turned = {"fiber_angle": states.fiber_angle + p.angle}
        if states.second_angle is not None:
            # A braid's families stay mirror images of each other.
            mirrored = torch.sign(states.second_angle * states.fiber_angle)
            turned["second_angle"] = states.second_angle + mirrored * p.angle
        return states.replace(**turned)
