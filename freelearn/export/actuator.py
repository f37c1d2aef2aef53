"""One fitted actuator as equations of one row: what is imposed on it, what it remembers, what it answers with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import DEAD_LOAD, ELONGATION, INFLATION, KINEMATIC, PRESSURE, TWIST, Bed, Quantity
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.export.arithmetic.function import Port
from freelearn.export.arithmetic.loops import severity
from freelearn.physics.chain.ports import TiltEffect
from freelearn.queries.fitted_model import FittedModel
from freelearn.queries.inverse.system import Span, System

# What a row may remember (States), as inputs: name, unit, what it is.
HISTORY = (
    Port("clock", "s", "time since the first reading"),
    Port("dwell", "s", "time since elongation and twist were last changed"),
    Port("moved_length", "m", "elongation now less the one before it was last changed"),
    Port("moved_twist", "rad", "twist now less the one before it was last changed"),
)
DIRECTION = "1 where the pressure last rose, -1 where it fell, 0 where it stands since the state was reached"
WORST, NEXT = "worst_severity", "worst_severity_next"
SEVERITY = "the largest severity so far, 0 for a virgin actuator: give back the same of _next"
UNITS = {"elongation": "m", "twist": "rad", "pressure": "Pa", "force": "N", "moment": "N*m", "diameter": "m"}


@dataclass(frozen=True)
class Actuator:
    """One sample of a fitted model, or its end block. sample: its number in the run's table. bed: what is imposed and
    what is answered, as `predict` does it."""

    fitted: FittedModel
    sample: int
    bed: Bed

    @classmethod
    def from_fitted(cls, fitted: FittedModel, sample: int | None = None) -> Actuator:
        """The run's actuator; of several the one that sample names. Raises UserError."""
        for effect in fitted.model.effects:
            if isinstance(effect, TiltEffect):
                raise UserError(f"Effect {effect.name!r} cannot be exported: fit the run without it.")
        bed = fitted.bed
        if fitted.model.family != "mlp" and bed not in (DEAD_LOAD, INFLATION):
            # Loads at a place, whether all of them were measured or not.
            bed = KINEMATIC
        there = sorted({int(s) for s in cls._rows(fitted).states.sample.tolist()})
        if sample is None:
            if len(there) > 1 and not fitted.members:
                raise UserError(
                    f"The run was fitted on {len(there)} actuators, samples {', '.join(map(str, there))}, and one is "
                    "exported: add sample=NUMBER."
                )
            return cls(fitted, there[0], bed)
        if sample not in there:
            raise UserError(f"The run holds no sample {sample}: choose of {', '.join(map(str, there))}.")
        return cls(fitted, sample, bed)

    @staticmethod
    def _rows(fitted: FittedModel) -> Rows:
        return fitted.rows if len(fitted.rows) else Rows.straight(fitted.run.table)

    @cached_property
    def held(self) -> Actuator | None:
        """The same actuator, asked for its loads at a place; None where that is what is asked already, and for a
        network, which answers one question alone."""
        if self.fitted.model.family == "mlp" or self.bed is KINEMATIC:
            return None
        return replace(self, bed=KINEMATIC)

    @property
    def remembers(self) -> bool:
        """Whether what it answers along a log depends on the samples before."""
        return self.fitted.model.remembers(self.rows)

    @cached_property
    def rows(self) -> States:
        """The states that the model was fitted on."""
        return self._rows(self.fitted).states

    @cached_property
    def states(self) -> States:
        """One row of the actuator that remembers nothing."""
        place = int(torch.nonzero((self.rows.sample == self.sample) | bool(self.fitted.members))[0, 0])
        row = self.rows[slice(place, place + 1)]
        still = torch.zeros(1, dtype=torch.float64)
        blank = dict.fromkeys(("direction", *(p.name for p in HISTORY), "severity", "past_severity"), still)
        members = tuple(m.replace(**blank, memory=None) for m in row.members)
        alone = {"memory": None, "recording": None, "place": None, "members": members, "bed": self.bed}
        return row.replace(**blank, **alone)

    @cached_property
    def system(self) -> System:
        """Its equations, of one row."""
        return System(self.fitted.model, self.states)

    @property
    def placed(self) -> bool:
        """Whether elongation and twist are imposed on it."""
        return self.bed.state == (ELONGATION, TWIST)

    @cached_property
    def imposed(self) -> tuple[Port, ...]:
        """What is imposed on it."""
        ports, number = [], 0
        for quantity in self.system.inputs:
            name = name_of(quantity)
            if quantity is PRESSURE and self.states.members:
                number += 1
                name = f"pressure_{number}"
            ports.append(Port(name, UNITS[name_of(quantity)], f"{name.replace('_', ' ')}{_more(quantity)}"))
        return tuple(ports)

    @cached_property
    def memory(self) -> tuple[Port, ...]:
        """What it may remember."""
        several = [f"_{i}" for i in range(1, len(self.states.members) + 1)] or [""]
        directions = (Port(f"direction{n}", "1", DIRECTION) for n in several)
        return (*directions, *HISTORY, *(Port(f"{WORST}{n}", "1", SEVERITY) for n in several))

    @property
    def shown(self) -> list[int]:
        """Which of the two readings it answers with: a network knows none that it was never shown."""
        return [i for i in (0, 1) if i not in self.fitted.never_shown]

    @property
    def answered(self) -> tuple[Port, ...]:
        """What it answers with."""
        readings = [self.system.bed.readings[i] for i in self.shown]
        return tuple(Port(name_of(q), UNITS[name_of(q)], _about(q)) for q in readings)

    def place(self, inputs: Sequence[Tensor]) -> tuple[System, Tensor, list[Tensor]]:
        """The equations with what is remembered, x (1, m), and the worst severities with this row's, (1,) each."""
        count, states = len(self.imposed), self.states
        x = torch.stack(list(inputs[:count]), dim=-1) + self.rest
        remembered = dict(zip((p.name for p in self.memory), inputs[count:], strict=True))
        # Under a dead load nobody knows the place beforehand: a row then counts as one at rest, as in predict.
        at = inputs[:2] if self.placed else [0.0 * inputs[0]] * 2
        shared, worst, each = {p.name: remembered[p.name] for p in HISTORY}, [], []
        for i, actuator in enumerate(states.members or (states,)):
            number = f"_{i + 1}" if states.members else ""
            now = severity(actuator, at[0], at[1], inputs[2 + i])
            worst.append(torch.maximum(remembered[f"{WORST}{number}"], now))
            own = {"direction": remembered[f"direction{number}"], "severity": now, "past_severity": worst[-1]}
            each.append(actuator.replace(**shared, **own))
        moved = states.replace(**shared, members=tuple(each)) if states.members else each[0]
        return System(self.fitted.model, moved), x, worst

    @cached_property
    def rest(self) -> Tensor:
        """What the equations' inputs are beyond those exported, (m,): the length at rest beyond the elongation."""
        length = float(self.states.reference_length)
        return torch.tensor([length if q is ELONGATION else 0.0 for q in self.system.inputs], dtype=torch.float64)

    @cached_property
    def span(self) -> Span:
        """What was gone through of its inputs, and where answers are looked for."""
        if self.bed is DEAD_LOAD and self.held is not None:
            return Span.from_system(System(self.fitted.model, self.rows))
        return self.fitted.asker.span

    @cached_property
    def edges(self) -> tuple[Tensor, Tensor]:
        """Least and largest of each input, (m,) each, that still lie within the data: as predict says it."""
        size, slack = self._sizes, self.fitted.asker.slack(self.system)
        low, high = self.span.measured
        return low * size - slack, high * size + slack

    def inside(self, x: Tensor) -> Tensor:
        """Whether the data reach to inputs x (N, m), (N,) bool."""
        low, high = self.edges
        return ((x >= low) & (x <= high)).all(-1)

    def rested(self, x: Tensor, place: Tensor) -> Tensor:
        """Of what hangs under inputs x (N, m) and rests at a place (N, 2): inputs of the bed that holds it there."""
        assert self.held is not None
        return torch.cat([place + self.held.rest[:2], x[:, 2:]], dim=-1)

    def reaches(self, x: Tensor, answer: Tensor) -> Tensor:
        """As inside, (N,) bool; of what hangs also to the place where it comes to rest. answer: (N, 2)."""
        inside = self.inside(x)
        if self.bed is DEAD_LOAD and self.held is not None:
            inside = inside & self.held.inside(self.rested(x, answer))
        return inside

    @property
    def _sizes(self) -> Tensor:
        length = float(self.states.reference_length)
        return torch.tensor([length if q is ELONGATION else 1.0 for q in self.system.inputs], dtype=torch.float64)

    @property
    def domain(self) -> list[tuple[float, float]]:
        """Least and largest of each input in the data the model was fitted on, SI; elongations, not lengths."""
        low, high = (edge * self._sizes for edge in self.span.measured)
        pairs = zip((low - self.rest).tolist(), (high - self.rest).tolist(), strict=True)
        return [(a, b) for a, b in pairs]


def name_of(quantity: Quantity) -> str:
    """Of a port: elongation, force and so on."""
    return "diameter" if "diameter" in quantity.column else quantity.column.rsplit("_", 1)[0]


def _more(quantity: Quantity) -> str:
    return ": length less the length at rest" if quantity is ELONGATION else ", gauge" if quantity is PRESSURE else ""


def _about(quantity: Quantity) -> str:
    return {
        "force": "force on the mount, positive where the actuator pushes",
        "moment": "moment on the mount, positive where it turns towards positive twist",
        "elongation": "length less the length at rest, where the actuator comes to rest",
        "twist": "twist where the actuator comes to rest",
        "diameter": "outer diameter",
    }[name_of(quantity)]
