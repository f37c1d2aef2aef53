"""A tube held shorter than it wants to be: beyond its buckling load it bends aside, and hardly pushes any harder."""

import math

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EvasionEffect

# Share of the buckling load below which the saturation is its series: the quotient would lose digits.
NEAR = 1e-3


class Bending(Parameters):
    """flexibility: one over the tube's bending stiffness."""

    flexibility: Tensor = parameter(
        "b",
        "1/(N·m²)",
        start=30.0,
        lower=0.0,
        upper=1e6,
        none=0.0,
        scale=100.0,
        prior=Prior(0.0, 200.0, "rubber tubes of 10 to 20 mm: E I of 10 MPa times some 1e-9 m⁴"),
    )


class Buckling(EvasionEffect[Bending]):
    """F > 0 → F_b (1 − e^(−F/F_b)), F_b = 4π²/(b L²): a push ends at Euler's load of a column that both ends clamp.

    A pull is what it was, and so is the moment. What an ideal tube would push beyond is taken up by bending. Past its
    buckling load a column pushes with that load, nearly whatever its shortening.
    """

    name = "buckling"
    place = 0
    suspect = "Held short, the tube hardly pushes at all, whatever the model says, and bends aside to the eye."
    source = "Euler (1744); Timoshenko, Theory of Elastic Stability (1961), sections 2.1 and 2.7"
    beds = ("isometric",)
    parameter_class = Bending

    def evade(self, loads: Tensor, states: States, p: Bending) -> Tensor:
        """As EvasionEffect.evade."""
        force, moment = loads.unbind(-1)
        by_load = p.flexibility * states.reference_length**2 / (4 * math.pi**2)
        over = force.clamp_min(0.0) * by_load
        near = over < NEAR
        far = torch.where(near, 1.0, over)
        share = torch.where(near, 1 - over / 2 + over**2 / 6, -torch.expm1(-far) / far)
        return torch.stack([force * share, moment], dim=-1)
