"""The stops of the chain where an effect can plug in: one base class, and one method to write, for each.

boundary     BoundaryEffect.impose   the state that was really imposed
             MountEffect.impose      the same, where it depends on the loads (a mount that gives way)
             PlayEffect.play         the same, where the actuator finds its own place (play between actuator and rig)
             TiltEffect.tilt         the same, where the block that several actuators share tilts under their pushes
geometry     GeometryEffect.reshape  the actuator as it really is
             EndEffect.dissipate     what its ends take off its loads, by a potential of their own
energy       EnergyEffect.psi        a further strain energy of the wall or its fibers
dissipation  WallEffect.soften       the share of the wall's stresses that is left
             DissipationEffect.dissipate  what of the actuator's loads reaches the mount
             EvasionEffect.evade     the same, where the actuator gives way sideways
measurement  MeasurementEffect.sense      what the sensors show
history      HistoryEffect.carry     what a pressure, a wall, loads or readings become by what was before, in a log
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import torch
from torch import Tensor

from freelearn.common.vmapped import all_if_known
from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import P, Parameters
from freelearn.physics.mechanics.automatic import along, gradient
from freelearn.physics.mechanics.energy import Energy
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.mechanics.wall import Wall


class BoundaryEffect(Effect[P]):
    """Changes the state that was imposed on the actuator, whatever the loads."""

    port = "boundary"
    method = "impose"

    def impose(self, states: States, p: P) -> States:
        """The states that were really imposed, from those that the table shows."""
        raise NotImplementedError

    def hand_on(self, loads: Tensor, states: States, p: P) -> Tensor:
        """Loads (N, 2) N, N·m on the mount, from those of an actuator at the states that `impose` gives of these.

        They do the same work: where a state imposed moves otherwise than the mount, they differ.
        """
        return loads


class MountEffect(Effect[P]):
    """A mount that gives way: the state that it imposes depends on the loads that it carries (see mount)."""

    of_each = False
    port = "boundary"
    method = "impose"
    yields = True

    def impose(self, states: States, loads: Tensor, p: P) -> States:
        """The states imposed while the mount carries loads (N, 2) N, N·m, from those that the table shows."""
        raise NotImplementedError


class PlayEffect(Effect[P]):
    """Play in twist between actuator and rig: within it the actuator finds its own place (see play)."""

    port = "boundary"
    method = "play"
    yields = True

    def play(self, states: States, p: P) -> Tensor:
        """Half the width w ≥ 0 of the band in which the actuator can turn freely, () or (N,) rad."""
        raise NotImplementedError


class TiltEffect(Effect[P]):
    """An end block that tilts under the unequal pushes of the actuators that it holds (see tilt).

    A network, which knows no single actuators of a block, has none.
    """

    of_each = False
    together = True
    port = "boundary"
    method = "tilt"
    yields = True

    def tilt(self, states: States, p: P) -> Tensor:
        """By how much c ≥ 0 an actuator is lifted for each newton that it pushes itself, () or (N,) m/N."""
        raise NotImplementedError

    @classmethod
    def families(cls) -> tuple[str, ...]:
        """As Effect.families."""
        return tuple(family for family in super().families() if family != "mlp")


class GeometryEffect(Effect[P]):
    """Changes the design: the actuator as it was really built and clamped."""

    port = "geometry"
    method = "reshape"

    def reshape(self, states: States, p: P) -> States:
        """The actuators as they really are, from those of the drawing."""
        raise NotImplementedError


class EnergyEffect(Effect[P]):
    """Adds a strain energy to the wall; the stresses follow by automatic differentiation.

    Its parameters are shared by all samples, and by the actuators of an end block unless it says `of_each`.
    """

    of_each = False
    port = "energy"
    method = "psi"
    # Invariants that `psi` takes: i1, i2, i4.
    depends_on: ClassVar[tuple[str, ...]] = ()
    # Whether it acts at the bore alone, as a thin liner does, and not all through the wall: psi is then [N/m].
    at_bore: ClassVar[bool] = False

    def psi(self, *invariants: Tensor, p: P, material: Material) -> Tensor:
        """Added strain energy at the invariants of `depends_on`; material: the model's own C1, C2.

        In Pa, per volume of the wall; at the bore in N/m, per area of the bore at rest.
        """
        raise NotImplementedError

    def psi_gradient(self, *invariants: Tensor, p: P, material: Material) -> tuple[Tensor, ...]:
        """∂psi/∂I for each invariant [Pa]. Automatic; an effect may write it by hand for speed."""

        def total(*args: Tensor) -> Tensor:
            return self.psi(*args, p=p, material=material).sum()

        return gradient(total, *invariants)

    def psi_hessian(self, *invariants: Tensor, p: P, material: Material) -> tuple[tuple[Tensor, ...], ...] | None:
        """∂²psi/∂I∂I [Pa], row by row. None leaves it to autograd; an effect may write it by hand for speed."""
        return None

    def closed_form(self, tube: Tube, p: P, material: Material) -> Wall | None:
        """The wall that this energy makes of N tubes, integrated exactly. None leaves it to quadrature."""
        return None

    def term(self, values: Mapping[str, Tensor], states: States | None = None) -> EffectEnergy:
        """The strain energy that the effect adds, as mechanics sees it. values: the model's, with C1 and C2. states:
        whose walls these are, where each actuator has parameters of its own."""
        material = Material(C1=values["C1"], C2=values["C2"])
        return EffectEnergy(self, self.own(values, states), material)

    @classmethod
    def problem(cls) -> str | None:
        """As Effect.problem; an energy must name invariants, and its parameters are shared by all samples unless it
        compares these."""
        if not cls.depends_on or not set(cls.depends_on) <= {"i1", "i2", "i4"}:
            return f"its depends_on {cls.depends_on} must name invariants: i1, i2, i4"
        if cls.at_bore and "i4" in cls.depends_on:
            return "an energy at the bore has no fibers: its depends_on must name i1 and i2 alone"
        if not cls.compares and any(p.per_sample for p in cls.declared_parameters()):
            return "the parameters of an energy are shared by all samples, and one of them is per_sample"
        return super().problem()


class WallEffect(Effect[P]):
    """Takes a share off the stresses of the wall and its fibers, never off the fluid's thrust."""

    port = "dissipation"
    method = "soften"
    late = True

    def soften(self, states: States, p: P) -> Tensor:
        """The factor s > 0, (N,), by which the wall's stresses are multiplied: 1 for a virgin wall."""
        raise NotImplementedError


class DissipationEffect(Effect[P]):
    """Takes work off on the way from the actuator to the mount (friction)."""

    port = "dissipation"
    method = "dissipate"
    late = True

    def dissipate(self, loads: Tensor, states: States, p: P) -> Tensor:
        """Loads (N, 2) N, N·m that reach the mount, from those of the actuator."""
        raise NotImplementedError


class EvasionEffect(Effect[P]):
    """What reaches the mount of an actuator that gives way sideways: in a log after all that its wall and friction
    carry."""

    of_each = False
    port = "dissipation"
    method = "evade"
    late = True

    def evade(self, loads: Tensor, states: States, p: P) -> Tensor:
        """Loads (N, 2) N, N·m on the mount, from those that the actuator would have straight."""
        raise NotImplementedError


class EndEffect(DissipationEffect[P]):
    """Changes the loads by what the actuator's ends are beside an ideal tube's, as a potential of their own does.

    It sees the actuator of the drawing at the state that it takes, and in the chain it stands before friction. Nothing
    is lost: ∂F/∂φ = ∂M/∂l at fixed pressure is kept.
    """

    port = "geometry"


class MeasurementEffect(Effect[P]):
    """Changes what the load cells show."""

    of_each = False
    port = "measurement"
    method = "sense"
    late = True

    def sense(self, loads: Tensor, states: States, p: P) -> Tensor:
        """Loads (N, 2) N, N·m that the sensors show, from those on the mount."""
        raise NotImplementedError


class HistoryEffect(Effect[P]):
    """Carries a state from sample to sample along each recording of a log; of rows without a recording it changes
    nothing.

    The state is updated exactly between samples, in which signals are straight lines, by a scan (recordings)
    and no loop over samples.
    """

    port = "history"
    method = "carry"
    needs = ("time_s", "run")
    beds: ClassVar[tuple[str, ...]] = ("kinematic", "isometric", "dead_load")
    of_each = False
    # What of the chain it acts on. supply: the pressure, before all else. wall: the stresses of the wall, so that the
    # pressure that the wall balances is `carry` undone, and the loads (or under a dead load, what hangs there, undone)
    # are carried. loads: what reaches the mount. readings: what the sensors show.
    acts_on: ClassVar[str] = "loads"

    def carry(self, signal: Tensor, recording: Recording[States], p: P) -> Tensor:
        """What the signal (M, c), SI, of all M samples of some recordings becomes: (M, c).

        c is 1 for a pressure, and 2 for the loads or readings. Each entry of p is ().
        """
        raise NotImplementedError

    def undo(self, signal: Tensor, recording: Recording[States], p: P) -> Tensor:
        """The signal of which `carry` would make this one, (M, c): of effects on the wall."""
        raise NotImplementedError

    @classmethod
    def problem(cls) -> str | None:
        """As Effect.problem; it must act on something that there is."""
        if cls.acts_on not in ACTED_ON:
            return f"its acts_on {cls.acts_on!r} must be one of {', '.join(ACTED_ON)}"
        if any(p.per_sample or p.per_member for p in cls.declared_parameters()):
            return "the parameters of an effect of the history are shared by all samples, and one of them is not"
        return super().problem()


# What an effect of the history may act on, in the order of the chain.
ACTED_ON = ("supply", "wall", "loads", "readings")

# Every base class that an effect may derive from.
BASES: tuple[type[Effect[Any]], ...] = (
    BoundaryEffect,
    MountEffect,
    PlayEffect,
    TiltEffect,
    GeometryEffect,
    EnergyEffect,
    WallEffect,
    DissipationEffect,
    EvasionEffect,
    MeasurementEffect,
    HistoryEffect,
)


@dataclass(frozen=True)
class EffectEnergy(Energy):
    """An effect's `psi` with its parameters filled in."""

    effect: EnergyEffect[Any]
    p: Parameters
    material: Material

    def __post_init__(self) -> None:
        # Class variables of every other energy: here each instance has its effect's.
        object.__setattr__(self, "depends_on", self.effect.depends_on)
        object.__setattr__(self, "at_bore", self.effect.at_bore)

    @property
    def idle(self) -> bool:
        """Whether every parameter that can stand for no effect does; False inside vmap, where nobody can know."""
        telling = [p for p in self.effect.declared_parameters() if p.none is not None]
        return bool(telling) and all(all_if_known(getattr(self.p, p.name) == p.none) for p in telling)

    def psi(self, *invariants: Tensor) -> Tensor:
        """The effect's strain energy [Pa]."""
        return self.effect.psi(*invariants, p=self.p, material=self.material)

    def gradient(self, *invariants: Tensor) -> tuple[Tensor, ...]:
        """∂Ψ/∂I for each invariant [Pa]."""
        return self.effect.psi_gradient(*invariants, p=self.p, material=self.material)

    def closed_form(self, tube: Tube) -> Wall | None:
        """As Energy.closed_form, where the effect has one."""
        return self.effect.closed_form(tube, self.p, self.material)

    def gradient_rate(
        self, invariants: tuple[Tensor, ...], rates: tuple[Tensor, ...]
    ) -> tuple[tuple[Tensor, ...], tuple[Tensor | None, ...]]:
        """As Energy.gradient_rate, from the effect's Hessian where it has one."""
        hessian = self.effect.psi_hessian(*invariants, p=self.p, material=self.material)
        if hessian is not None:
            return self.gradient(*invariants), tuple(
                sum((h * rate for h, rate in zip(row[1:], rates[1:], strict=True)), start=row[0] * rates[0])
                for row in hessian
            )
        return along(self.gradient, invariants, rates)

    def detach(self) -> EffectEnergy:
        """The same energy with its parameters cut from every derivative."""
        return EffectEnergy(self.effect, self.p.detach(), self.material.detach())


def columns(force: Tensor, moment: Tensor) -> Tensor:
    """Loads (N, 2) from force [N] and moment [N·m], each scalar or (N,)."""
    return torch.stack(torch.broadcast_tensors(force, moment), dim=-1)
