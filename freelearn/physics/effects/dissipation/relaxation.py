"""Rubber and threads that creep under load: their stresses decay while a state lasts."""

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import WallEffect


class Prony(Parameters):
    """share: of the stresses that is lost in the end; time: in which all but 1/e of that is lost."""

    share: Tensor = parameter(
        "g",
        "1",
        start=0.05,
        lower=0.0,
        upper=0.95,
        none=0.0,
        scale=0.1,
        prior=Prior(0.0, 0.2, "rubbers lose a tenth to a fifth in minutes: Ferry (1980)"),
    )
    time: Tensor = parameter(
        "τ",
        "s",
        start=60.0,
        lower=1.0,
        upper=1e5,
        log=True,
        scale=60.0,
        prior=Prior(60.0, 2.0, "seconds to hours: Ferry (1980)"),
    )


class Relaxation(WallEffect[Prony]):
    """σ wall · (1 − g (1 − e^(−t/τ))), t the time since the kinematic state was reached: one Prony term.

    The wall relaxes, the fluid's pressure and thrust do not.
    """

    name = "relaxation"
    place = 2
    suspect = "Loads decay while a state lasts, so that late readings of a state are lower than early ones."
    source = "one term of a Prony series: Christensen (1982)"
    needs = ("time_s",)
    parameter_class = Prony
    loose = 0.02

    def soften(self, states: States, p: Prony) -> Tensor:
        """As WallEffect.soften."""
        return 1 + p.share * torch.expm1(-states.dwell / p.time)
