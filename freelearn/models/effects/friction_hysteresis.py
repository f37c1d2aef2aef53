"""Friction of fibres and seals: the load lags behind the pressure."""

from types import SimpleNamespace

from torch import Tensor

from freelearn.measurements.states import States
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, columns


class FrictionHysteresis(Effect):
    """A constant force F_f and moment M_f against the direction in which the pressure changed.

    Both are signed: a load that falls with the pressure lags the other way. Each sample rubs on its own: how much
    depends on how taut its fibres lie.
    """

    name = "friction_hysteresis"
    suspect = "Loads at one pressure differ between inflating and deflating."
    source = "Coulomb friction as in Chou & Hannaford (1996) for McKibben muscles"
    parameters = (
        Parameter("force", "F_f", "N", start=0.0, none=0.0, scale=0.5, per_sample=True),
        Parameter("moment", "M_f", "N·m", start=0.0, none=0.0, scale=5e-3, per_sample=True),
    )

    def dissipate(self, loads: Tensor, states: States, p: SimpleNamespace) -> Tensor:
        return loads - states.direction[:, None] * columns(p.force, p.moment)
