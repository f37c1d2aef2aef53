"""The chain from an imposed state to the loads that the sensors show, with the effects in their places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any, TypeVar

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import DEAD_LOAD, INFLATION
from freelearn.data.states import States
from freelearn.physics.chain.dead_load import End, solve_dead_load
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.history import along
from freelearn.physics.chain.mount import Settled, before_mount, settle
from freelearn.physics.chain.parameters import Parameter
from freelearn.physics.chain.play import take_up
from freelearn.physics.chain.ports import (
    ACTED_ON,
    BoundaryEffect,
    DissipationEffect,
    EvasionEffect,
    GeometryEffect,
    HistoryEffect,
    MeasurementEffect,
    MountEffect,
    PlayEffect,
    TiltEffect,
    WallEffect,
)
from freelearn.physics.chain.prediction import Prediction, SwollenPrediction
from freelearn.physics.chain.raw_vector import RawVector, Values
from freelearn.physics.chain.tilt import tilt

# Rows predicted at once: few enough for what they make to stay in the processor's cache, and many for what each
# operation costs whatever it is done to.
BLOCK = 8192

E = TypeVar("E", bound=Effect[Any])


class Chain(RawVector):
    """boundary → geometry → loads of the structure → dissipation → measurement, with the named effects inside."""

    def __init__(
        self,
        declared: Mapping[str, Parameter],
        effects: Sequence[Effect[Any]] = (),
        weights: Mapping[str, tuple[int, ...]] | None = None,
    ) -> None:
        """declared: the model's own parameters; those of the effects join them. weights: as in RawVector."""
        self_and_effects = dict(declared)
        for effect in effects:
            self_and_effects |= effect.declared()
        super().__init__(self_and_effects, weights)
        self.effects = tuple(effects)
        self._boundary = self._of(BoundaryEffect)
        # Boundary effects whose loads on the mount are not the actuator's.
        self.levers = [e for e in self._boundary if type(e).hand_on is not BoundaryEffect.hand_on]
        self._mounts = self._of(MountEffect)
        self._plays = self._of(PlayEffect)
        self._tilts = self._of(TiltEffect)
        self._geometry = self._of(GeometryEffect)
        self._wall = self._of(WallEffect)
        self._dissipation = self._of(DissipationEffect)
        self._evasion = self._of(EvasionEffect)
        self._measurement = self._of(MeasurementEffect)
        remembering = self._of(HistoryEffect)
        # Effects of the history by what they act on.
        self.history = {name: [e for e in remembering if e.acts_on == name] for name in ACTED_ON}
        self._remembering = bool(remembering)

    def _of(self, base: type[E]) -> list[E]:
        return [effect for effect in self.effects if isinstance(effect, base)]

    def forward(self, states: States, values: Values | None = None) -> Prediction:
        """Loads of N states: States → loads (N, 2) N, N·m and status (N,). values: may differ from row to row."""
        values = self.values() if values is None else values
        if len(states) > BLOCK and not self.remembers(states):
            some = [slice(i, i + BLOCK) for i in range(0, len(states), BLOCK)]
            blocks = [self.chain(states[rows], self.rows_of(values, rows)) for rows in some]
            return Prediction(torch.cat([b.loads for b in blocks]), torch.cat([b.status for b in blocks]))
        return self.chain(states, values)

    def chain(self, states: States, values: Values) -> Prediction:
        """`forward` in one block, with values that may differ from row to row: what the bed of the states measures.

        loads then is force and moment, or what else it measures (Bed.readings), (N, 2) SI.
        """
        return along(self, states, values) if self.remembers(states) else self.steady(states, values)

    def remembers(self, states: States) -> bool:
        """Whether what these rows show depends on the samples before them: an effect of the history, and a log."""
        return self._remembering and states.recording is not None

    def steady(self, states: States, values: Values) -> Prediction:
        """`chain` of every row by itself, without effects of the history."""
        if states.bed is DEAD_LOAD:
            return self._hung(states, values) if self._mounts else self._at_rest(states, values)
        settled, shown = self._shown(states, values)
        if states.bed is not INFLATION:
            return shown
        if isinstance(shown, SwollenPrediction):
            # Of one actuator that stands where the table says, the search for its equilibrium has told it.
            swollen = shown.diameter
        else:
            swollen = self.swollen(self.imposed(settled, values), values)
        readings = torch.stack([shown.loads[..., 0], swollen], dim=-1)
        return Prediction(readings, shown.status)

    def _at_rest(self, states: States, values: Values, end: End | None = None) -> Prediction:
        """Elongation and twist (N, 2) at which the actuator's end carries the loads imposed. end: as solve_dead_load
        has it."""

        def shown(at: States, values: Values) -> Prediction:
            return self._seen(self._rested(at, values), at, values)

        return solve_dead_load(states, values, shown, self.rows_of, end)

    def _hung(self, states: States, values: Values) -> Prediction:
        """The same of the mount, which gives way under these loads: the actuator's end first, which knows of them all
        that there is, and then the mount. So none is searched for inside the search for the other."""
        hung = torch.stack([states.force, states.moment], dim=-1)
        still = {name: value.detach() for name, value in values.items()}
        rest = torch.stack([states.reference_length, 0 * states.twist], dim=-1)

        def end(seen: Tensor) -> Tensor:
            at = self._mounted(states.replace(length=seen[:, 0], twist=seen[:, 1]), hung, still)
            return torch.stack([at.length, at.twist], dim=-1)

        found = self._at_rest(states, values, end)
        place = found.loads + rest
        if self._measurement:
            # What the cells show of them is imposed, not what is carried.
            hung = self._rested(states.replace(length=place[:, 0], twist=place[:, 1]), values).loads
        seen = before_mount(states, place, hung, values, self._mounted)
        return Prediction(seen.loads - rest, torch.maximum(found.status, seen.status))

    def unsensed(self, states: States, values: Values) -> Prediction:
        """Force and moment (N, 2) on the mount of every row by itself, before the sensors."""
        return self._reached(states, values).prediction

    def straight(self, states: States, values: Values) -> Prediction:
        """`unsensed` of actuators that do not give way sideways, where the mount leaves those that do."""
        if not self._evasion:
            return self.unsensed(states, values)
        return self._pushed(self._reached(states, values).states if self._mounts else states, values)

    def _reached(self, states: States, values: Values) -> Settled:
        """The state that the mount leaves, and force and moment there."""
        if self._mounts:
            return settle(states, values, self._mounted, self._rested, self.rows_of)
        return Settled(states, self._rested(states, values))

    def _shown(self, states: States, values: Values) -> Settled:
        """The state that the mount leaves, and force and moment that the sensors show there."""
        states, found = self._reached(states, values)
        return Settled(states, self._seen(found, states, values))

    def _seen(self, found: Prediction, states: States, values: Values) -> Prediction:
        """What the sensors show of loads on the mount."""
        return found.with_loads(self.sensed(found.loads, states, values))

    @property
    def yielding(self) -> list[Effect[Any]]:
        """Boundary effects whose imposed state depends on the loads."""
        return [effect for effect in self.effects if effect.yields]

    def imposed(self, states: States, values: Values) -> States:
        """The states that were really imposed on the actuator."""
        return self._imposed(states, values)[-1]

    def _imposed(self, states: States, values: Values) -> list[States]:
        """The states before each boundary effect, and those that the last one leaves."""
        imposed = [states]
        for effect in self._boundary:
            imposed.append(effect.impose(imposed[-1], effect.own(values, states)))
        return imposed

    def _mounted(self, states: States, loads: Tensor, values: Values) -> States:
        """The states imposed by a mount that carries these loads."""
        for effect in self._mounts:
            states = effect.impose(states, loads, effect.own(values, states))
        return states

    def _rested(self, states: States, values: Values) -> Prediction:
        """Loads on the mount where the table says."""
        found = self._pushed(states, values)
        return found.with_loads(self.evaded(found.loads, states, values))

    def _pushed(self, states: States, values: Values) -> Prediction:
        """The same of straight actuators: those of one, or of all that share the end block."""
        if not states.members and not self._tilts:
            return self._alone(states, values)
        count = max(len(states.members), 1)
        each = self.rows_of(values, torch.arange(len(states), device=states.length.device).repeat(count))
        beside = states.side_by_side() if states.members else states
        if self._tilts:
            soft = [effect.tilt(states, effect.own(values, states)) for effect in self._tilts]
            loads, status = tilt(beside, count, sum(soft[1:], start=soft[0]), each, self._alone, self.rows_of)
        else:
            loads, status = self._alone(beside, each)
        # The first reason not to trust a member's loads is one not to trust the sum.
        return Prediction(loads.reshape(count, -1, 2).sum(0), status.reshape(count, -1).amax(0))

    def _alone(self, states: States, values: Values) -> Prediction:
        """Loads that one actuator hands on to the mount from the state that was really imposed on it."""
        *before, imposed = self._imposed(states, values)
        found = self._taken_up(imposed, values)
        loads = found.loads
        for effect, at in zip(reversed(self._boundary), reversed(before), strict=True):
            if effect in self.levers:
                loads = effect.hand_on(loads, at, effect.own(values, at))
        return found.with_loads(loads)

    def _taken_up(self, states: States, values: Values) -> Prediction:
        """Loads of the actuator where it has taken up the play between it and the mount."""
        if not self._plays:
            return self._carried(states, values)
        widths = [effect.play(states, effect.own(values, states)) for effect in self._plays]
        width = sum(widths[1:], start=widths[0]).expand_as(states.twist)
        # Where the actuator comes to rest in the band is not where the table says.
        return Prediction(*take_up(states, width, values, self._carried, self.rows_of))

    def _carried(self, states: States, values: Values) -> Prediction:
        """Loads that the actuator hands on at the state that it takes itself: ideal, then dissipated."""
        found = self.ideal(states, values)
        return found.with_loads(self.dissipated(found.loads, states, values))

    def ideal(self, states: States, values: Values) -> Prediction:
        """Loads of the actuator as it really is, at the state that was really imposed: geometry → structure.

        A wall whose stresses are all s times as large carries s times the pressure, and pushes and turns s times as
        hard, at the same deformation; the fluid is what it was. So loads(s, P) = s · loads(1, P/s), whatever the wall.
        """
        shaped, left = self._built(states, values)
        found = self.bare(shaped, values)
        return found if left is None else found.with_loads(found.loads * left[..., None])

    def swollen(self, states: States, values: Values) -> Tensor:
        """Outer diameter of the actuator as it really is, at the state that was really imposed: (N,) m."""
        return self.diameter(self._built(states, values)[0], values)

    def _built(self, states: States, values: Values) -> tuple[States, Tensor | None]:
        """The actuator as it was really built, under the pressure that its wall would balance virgin; what is left of
        the wall's stresses."""
        shaped = states
        for effect in self._geometry:
            shaped = effect.reshape(shaped, effect.own(values, states))
        left = self.wall_left(states, values)
        return (shaped if left is None else shaped.replace(pressure=shaped.pressure / left)), left

    def wall_left(self, states: States, values: Values) -> Tensor | None:
        """Factor s of the wall's stresses that its effects leave, (N,); None without such effects."""
        factors = [effect.soften(states, effect.own(values, states)) for effect in self._wall]
        return reduce(torch.mul, factors) if factors else None

    def bare(self, states: States, values: Values) -> Prediction:
        """Loads of the structure itself, with no effect but energies: what a model must give."""
        raise NotImplementedError

    def diameter(self, states: States, values: Values) -> Tensor:
        """Outer diameter of the structure itself, (N,) m. Raises UserError where a model has none."""
        raise UserError(f"Model {self.name!r} tells no outer diameter, which the bed {states.bed.name} measures.")

    def dissipated(self, loads: Tensor, states: States, values: Values) -> Tensor:
        """What of the actuator's loads reaches the mount."""
        for effect in self._dissipation:
            loads = effect.dissipate(loads, states, effect.own(values, states))
        return loads

    def evaded(self, loads: Tensor, states: States, values: Values) -> Tensor:
        """What of a straight actuator's loads reaches the mount where it gives way sideways."""
        for effect in self._evasion:
            loads = effect.evade(loads, states, effect.own(values, states))
        return loads

    def sensed(self, loads: Tensor, states: States, values: Values) -> Tensor:
        """What the sensors show of the loads on the mount."""
        for effect in self._measurement:
            loads = effect.sense(loads, states, effect.own(values, states))
        return loads
