"""Rubber and threads that creep under load: the loads decay while a state is held."""

from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, per_row


class Relaxation(Effect):
    """Loads · (1 − g (1 − e^(−t/τ))), t the time since the kinematic state was reached: one Prony term."""

    name = "relaxation"
    suspect = "Loads decay while a state is held, so that late readings of a state are lower than early ones."
    source = "one term of a Prony series: Christensen (1982)"
    needs = ("time_s",)
    parameters = (
        Parameter("share", "g", "1", start=0.05, lower=0.0, upper=0.95, none=0.0, scale=0.1),
        Parameter("time", "τ", "s", start=60.0, lower=1.0, upper=1e5, log=True, scale=60.0),
    )

    def dissipate(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        relaxed = -torch.expm1(-states.dwell / p.time)
        return loads * (1 - per_row(p.share * relaxed))
