"""Rubber and threads that creep: after every change their stresses go on changing for a while."""

from typing import Any

from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.lags import lag
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import HistoryEffect


class Arm(Parameters):
    """share: stiffness of the arm over that of the wall at rest; time: in which all but 1/e of an
    overstress is gone."""

    share: Tensor = parameter(
        "g",
        "1",
        start=0.05,
        lower=0.0,
        upper=5.0,
        none=0.0,
        scale=0.1,
        prior=Prior(0.0, 0.2, "rubbers lose a tenth to a fifth in minutes: Ferry (1980)"),
    )
    time: Tensor = parameter(
        "τ",
        "s",
        start=3.0,
        lower=1e-3,
        upper=1e5,
        log=True,
        scale=3.0,
        prior=Prior(3.0, 2.0, "tenths of a second to minutes, as a log of minutes shows it: Ferry (1980)"),
    )


class Creep(HistoryEffect[Arm]):
    """S = S_e + g h, h' = S_e' − h/τ: one Prony arm on the wall's stresses, of finite strain.

    All stresses of the wall relax alike. Radially the wall balances the pressure, so the wall deforms as an elastic one
    does under P_e with P = P_e + g h[P_e], which the arm undone gives at once; the loads are those at P_e, carried by
    the arm. (Exact where the bore does not change; the thrust on the bore's change, g h[ΔA] P, is left out.) Under a
    dead load the loads that hang there are undone too. The wall is at rest when a recording begins.
    """

    name = "creep"
    place = 4
    acts_on = "wall"
    suspect = "After a step the reading goes on moving for seconds; loops are wider at one rate than at another."
    source = "Simo (1987), On a fully three-dimensional finite-strain viscoelastic damage model; Fung (1993)"
    parameter_class = Arm
    loose = 0.1

    def carry(self, signal: Tensor, recording: Recording[States], p: Arm) -> Tensor:
        """As HistoryEffect.carry."""
        return signal + p.share * lag(signal, recording, p.time)

    def undo(self, signal: Tensor, recording: Recording[States], p: Arm) -> Tensor:
        """As HistoryEffect.undo: (1 + g τs/(1 + τs))⁻¹ = 1 − g/(1 + g) · τ's/(1 + τ's), τ' = (1 + g) τ."""
        return signal - p.share / (1 + p.share) * lag(signal, recording, (1 + p.share) * p.time)


def _slower(seconds: float) -> Any:
    """The time of a further arm, about so long."""
    known = Prior(seconds, 2.0, "of what relaxes over decades of time each decade counts: Ferry (1980)")
    return parameter("τ", "s", start=seconds, lower=1e-3, upper=1e7, log=True, scale=seconds, prior=known)


class SlowArm(Arm):
    """As Arm, of half a minute."""

    time: Tensor = _slower(30.0)


class SlowestArm(Arm):
    """As Arm, of minutes."""

    time: Tensor = _slower(300.0)


class SecondCreep(Creep):
    """A second arm: (1 + g L)(1 + g₂ L₂), L = τs/(1 + τs), is a series of arms with the same times, g (1 + g₂ τ₂/(τ₂ −
    τ)) and g₂ (1 − g τ/(τ₂ − τ)), and every series of two arms is such a product."""

    name = "second_creep"
    suspect = "After a step the reading moves for seconds and goes on for minutes: no one time fits."
    parameter_class = SlowArm
    beside = "creep"


class ThirdCreep(Creep):
    """A third arm, as `second_creep`."""

    name = "third_creep"
    suspect = "Beside two times of creep a slower one is left."
    parameter_class = SlowestArm
    beside = "second_creep"
