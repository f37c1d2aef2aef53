"""Rubber that has been worked harder before is softer (Mullins effect)."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import WallEffect


class Softening(Parameters):
    """depth: the largest share of the stresses that is lost; severity: the step below the worst at which much is."""

    depth: Tensor = parameter(
        "d",
        "1",
        start=0.05,
        lower=0.0,
        upper=0.95,
        none=0.0,
        scale=0.1,
        prior=Prior(0.0, 0.3, "Ogden & Roxburgh (1999); silicones less: Machado et al. (2010)"),
    )
    severity: Tensor = parameter(
        "m",
        "1",
        start=1e-2,
        lower=1e-5,
        upper=10.0,
        log=True,
        scale=1e-2,
        prior=Prior(0.02, 2.0, "steps of 0.03 to 100 %: Ogden & Roxburgh (1999)"),
    )


class StressSoftening(WallEffect[Softening]):
    """σ wall · (1 − d tanh((S_max − S)/m)), S the severity of the row and S_max the largest so far (see `States`).

    On the virgin path S = S_max and nothing is lost. Ogden & Roxburgh have the error function of each point's strain
    energy; the severity, that of a thin tube, stands for it, so that a row's factor needs no history but its inputs.
    The fluid keeps its thrust.
    """

    name = "stress_softening"
    place = 3
    suspect = "A repeated state shows lower loads once the actuator has been to a harsher one."
    source = "after Ogden & Roxburgh (1999)"
    parameter_class = Softening
    loose = 0.05

    def soften(self, states: States, p: Softening) -> Tensor:
        """As WallEffect.soften."""
        return 1 - p.depth * torch.tanh((states.past_severity - states.severity) / p.severity)
