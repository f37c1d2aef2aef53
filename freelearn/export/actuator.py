"""One fitted actuator as functions of plain numbers: loads, stiffness, bands, and the pressure for a load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import ELONGATION, PRESSURE, Quantity
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.export.arithmetic.function import Function, Port, pruned
from freelearn.export.arithmetic.loops import repeated, severity
from freelearn.export.arithmetic.trace import traced
from freelearn.export.banded import Banded
from freelearn.physics.chain.ports import TiltEffect
from freelearn.physics.chain.prediction import Status
from freelearn.physics.chain.row_derivatives import rows_jacobian
from freelearn.queries.fitted_model import FittedModel
from freelearn.queries.inverse.system import System

# What a row may remember (States), as inputs: name, unit, what it is.
HISTORY = (
    Port("clock", "s", "time since the first reading"),
    Port("dwell", "s", "time since elongation and twist were last changed"),
    Port("moved_length", "m", "elongation now less the one before it was last changed"),
    Port("moved_twist", "rad", "twist now less the one before it was last changed"),
    Port("worst_severity", "1", "the largest severity so far, 0 for a virgin actuator: give back worst_severity_next"),
)
DIRECTION = "1 where the pressure last rose, -1 where it fell, 0 where it stands since the state was reached"
# The search for a pressure: parts of its span that are looked through, and turns in the one with a solution.
PARTS, TURNS = 24, 24
UNITS = {"elongation": "m", "twist": "rad", "pressure": "Pa", "force": "N", "moment": "N*m", "diameter": "m"}
STATUS = "; ".join(f"{int(s)} {s.name.lower()}" for s in Status)


@dataclass(frozen=True)
class Actuator:
    """One sample of a fitted model, or its end block. sample: its number in the run's table."""

    fitted: FittedModel
    sample: int

    @classmethod
    def from_fitted(cls, fitted: FittedModel, sample: int | None = None) -> Actuator:
        """The run's actuator; of several the one that sample names. Raises UserError."""
        for effect in fitted.model.effects:
            if isinstance(effect, TiltEffect):
                raise UserError(f"Effect {effect.name!r} cannot be exported: fit the run without it.")
        there = sorted({int(s) for s in cls._rows(fitted).states.sample.tolist()})
        if fitted.members:
            return cls(fitted, there[0])
        if sample is None:
            if len(there) > 1:
                raise UserError(
                    f"The run was fitted on {len(there)} actuators, samples {', '.join(map(str, there))}, and one is "
                    "exported: add sample=NUMBER."
                )
            return cls(fitted, there[0])
        if sample not in there:
            raise UserError(f"The run holds no sample {sample}: choose of {', '.join(map(str, there))}.")
        return cls(fitted, sample)

    @staticmethod
    def _rows(fitted: FittedModel) -> Rows:
        return fitted.rows if len(fitted.rows) else Rows.from_table(fitted.run.table)

    @cached_property
    def states(self) -> States:
        """One row of the actuator that remembers nothing."""
        every = self._rows(self.fitted).states
        place = int(torch.nonzero((every.sample == self.sample) | bool(self.fitted.members))[0, 0])
        row = every[slice(place, place + 1)]
        still = torch.zeros(1, dtype=torch.float64)
        blank = dict.fromkeys(("direction", *(p.name for p in HISTORY[:4]), "severity", "past_severity"), still)
        members = tuple(m.replace(**blank, memory=None) for m in row.members)
        return row.replace(**blank, memory=None, members=members)

    @cached_property
    def system(self) -> System:
        """Its equations, of one row."""
        return System.from_model(self.fitted.model, self.states)

    @cached_property
    def imposed(self) -> tuple[Port, ...]:
        """What is imposed on it."""
        several = self.system.pressures > 1 or bool(self.states.members)
        ports, number = [], 0
        for quantity in self.system.inputs:
            name = _name(quantity)
            if quantity is PRESSURE and several:
                number += 1
                name = f"pressure_{number}"
            ports.append(Port(name, UNITS[_name(quantity)], f"{name.replace('_', ' ')}{_more(quantity)}"))
        return tuple(ports)

    @cached_property
    def memory(self) -> tuple[Port, ...]:
        """What it may remember."""
        count = len(self.states.members)
        names = [f"direction_{i}" for i in range(1, count + 1)] or ["direction"]
        return (*(Port(name, "1", DIRECTION) for name in names), *HISTORY)

    @property
    def answered(self) -> tuple[Port, ...]:
        """What it answers with."""
        return tuple(Port(_name(q), UNITS[_name(q)], _about(q)) for q in self.system.bed.readings)

    def place(self, inputs: Sequence[Tensor]) -> tuple[System, Tensor, Tensor]:
        """The equations with what is remembered, x (1, m), and the worst severity with this row's, (1,)."""
        count, states = len(self.imposed), self.states
        x = torch.stack(list(inputs[:count]), dim=-1) + self.rest
        remembered = dict(zip((p.name for p in self.memory), inputs[count:], strict=True))
        now = severity(states, *inputs[:3]) if self.system.mechanical and not states.members else 0.0 * inputs[0]
        worst = torch.maximum(remembered["worst_severity"], now)
        shared = {p.name: remembered[p.name] for p in HISTORY[:4]} | {"severity": now, "past_severity": worst}
        members = tuple(
            m.replace(direction=remembered[f"direction_{i}"], **shared) for i, m in enumerate(states.members, start=1)
        )
        direction = remembered.get("direction", 0.0 * inputs[0])
        moved = self.system.states.replace(direction=direction, members=members, **shared)
        return System(self.fitted.model, moved), x, worst

    @cached_property
    def rest(self) -> Tensor:
        """What the equations' inputs are beyond those exported, (m,): the length at rest beyond the elongation."""
        length = float(self.states.reference_length)
        return torch.tensor([length if q is ELONGATION else 0.0 for q in self.system.inputs], dtype=torch.float64)

    @cached_property
    def forward(self) -> Function:
        """Everything that is known at a state: loads, their derivatives, bands, and whether to trust them."""
        # Made before the trace, which cannot look at numbers.
        banded, answered, values, _ = self.banded, self.answered, self.system.values, (self.edges, self.rest)

        def known(*inputs: Tensor) -> list[Tensor]:
            system, x, worst = self.place(inputs)

            def outputs(at: Tensor) -> Tensor:
                return system.model.chain(system.states.with_inputs(at.unbind(-1)), values).loads

            loads, status = system.model.chain(system.states.with_inputs(x.unbind(-1)), values)
            slopes = rows_jacobian(outputs, x)[1]
            half = [banded.outputs * banded.deviations(system, x, slopes)] if banded else []
            return [loads, status.to(torch.float64), self._inside(x).to(torch.float64), slopes, *half, worst]

        ports = (*self.imposed, *self.memory)
        graph, nodes = traced(known, len(ports), f"Model {self.fitted.title}")
        out = [
            *answered,
            Port("status", "1", f"what the model says of the row: {STATUS}"),
            Port(
                "inside",
                "1",
                "1 where the data that the model was fitted on reach, 0 beyond: nothing is promised there",
            ),
            *(
                Port(f"d_{y.name}_by_{x.name}", f"{y.unit}/({x.unit})", f"derivative of the {y.name} by the {x.name}")
                for y in answered
                for x in self.imposed
            ),
            *(
                Port(f"{y.name}_half_band", y.unit, f"half of the 95 % band of the {y.name}")
                for y in answered
                if banded is not None
            ),
            Port("worst_severity_next", "1", "worst_severity of the next call"),
        ]
        remembers = any(_depends(graph, some, len(ports) - 1) for some in nodes[:-1])
        flat = [i for some in nodes for i in some]
        if not remembers:
            flat, nodes, out = flat[:-1], nodes[:-1], out[:-1]
        inputs = pruned(graph, nodes, ports, len(self.imposed))
        return Function(
            "forward", "loads, derivatives, bands and flags at a state", inputs, tuple(out), graph, tuple(flat)
        )

    @property
    def functions(self) -> list[Function]:
        """What is exported, each with what it needs alone."""
        whole, loads = self.forward, [p.name for p in self.answered]
        after = [p.name for p in whole.outputs if p.name == "worst_severity_next"]
        flags = ["status", "inside"]
        rates = [p.name for p in whole.outputs if p.name.startswith("d_")]
        bands = [p.name for p in whole.outputs if p.name.endswith("_half_band")]
        found = [
            whole.part("loads", f"{' and '.join(loads)} at a state", [*loads, *flags, *after]),
            whole.part(
                "stiffness",
                "their derivatives: the stiffness, its sign turned, and what pressure adds",
                [*rates, *flags],
            ),
        ]
        if bands:
            found.append(whole.part("band", "half of the 95 % band for a new measurement", [*bands, *flags]))
        return [*found, *self.inverses]

    @cached_property
    def inverses(self) -> list[Function]:
        """The pressure for a force, and for a moment; none where there are several pressures, or no loads."""
        if not self.system.mechanical or self.states.members:
            return []
        return [self._inverse(i) for i in (0, 1)]

    @cached_property
    def banded(self) -> Banded | None:
        """Its bands; None where no row tells them."""
        return Banded.from_miss(self.fitted.bands.miss, self.system) if self.fitted.bands else None

    @cached_property
    def edges(self) -> tuple[Tensor, Tensor]:
        """Least and largest of each input, (m,) each, that still lie within the data: as predict says it."""
        asker, size = self.fitted.asker, self._sizes
        (low, high), slack = asker.span.measured, asker.slack(self.system)
        return low * size - slack, high * size + slack

    def _inside(self, x: Tensor) -> Tensor:
        """Whether the data reach there, (1,)."""
        low, high = self.edges
        return ((x >= low) & (x <= high)).all(-1)

    @property
    def _sizes(self) -> Tensor:
        return torch.tensor(
            [float(self.states.reference_length) if q is ELONGATION else 1.0 for q in self.system.inputs],
            dtype=torch.float64,
        )

    @property
    def domain(self) -> list[tuple[float, float]]:
        """Least and largest of each input in the data the model was fitted on, SI; elongations, not lengths."""
        low, high = (edge * self._sizes for edge in self.fitted.asker.span.measured)
        pairs = zip((low - self.rest).tolist(), (high - self.rest).tolist(), strict=True)
        return [(a, b) for a, b in pairs]

    def _inverse(self, given: int) -> Function:
        """The least pressure at which one load is what is wanted, elongation and twist held."""
        low, high = (float(edge[2]) for edge in self.fitted.asker.span.looked)
        banded, values, _ = self.banded, self.system.values, (self.edges, self.rest)
        name = self.answered[given].name

        def found(*inputs: Tensor) -> list[Tensor]:
            wanted, rest = inputs[2], inputs[3:]

            def lacking(pressure: Tensor) -> Tensor:
                system, x, _ = self.place((*inputs[:2], pressure, *rest))
                loads, status = system.model.chain(system.states.with_inputs(x.unbind(-1)), values)
                return torch.where(status == Status.OK, loads[:, given] - wanted, torch.nan)

            pressure, there = _least_zero(lacking, low, high, wanted)
            system, x, _ = self.place((*inputs[:2], pressure, *rest))

            def outputs(at: Tensor) -> Tensor:
                return system.model.chain(system.states.with_inputs(at.unbind(-1)), values).loads

            loads, slopes = rows_jacobian(outputs, x)
            rate = slopes[:, given, 2]
            moves = there & (rate != 0)
            polished = pressure - torch.where(moves, (loads[:, given] - wanted) / torch.where(moves, rate, 1.0), 0.0)
            half = []
            if banded:
                half = [banded.inverse[given] * banded.deviations(system, x, slopes)[:, given] / rate.abs()]
            at = torch.stack([x[:, 0], x[:, 1], polished], dim=-1)
            return [polished, there.to(torch.float64), self._inside(at).to(torch.float64), *half]

        wanted = Port(name, UNITS[name], f"the {name} wanted")
        ports = (*self.imposed[:2], wanted, *self.memory)
        graph, nodes = traced(found, len(ports), f"The inverse of model {self.fitted.title}")
        out = [
            Port("pressure", "Pa", f"the least pressure at which the {name} is that; at the nearest end where none is"),
            Port("found", "1", "1 where there is one within the pressures that were measured and a twentieth more"),
            Port("inside", "1", "1 where the data that the model was fitted on reach"),
            *([Port("pressure_half_band", "Pa", "half of the 95 % band of the pressure")] if banded else []),
        ]
        flat = tuple(i for some in nodes for i in some)
        about = f"the pressure for a {name}, elongation and twist held"
        return Function(f"pressure_for_{name}", about, pruned(graph, nodes, ports, 3), tuple(out), graph, flat)


def _least_zero(lacking: Any, low: float, high: float, like: Tensor) -> tuple[Tensor, Tensor]:
    """The least zero in [low, high] of a function of the pressure, and whether there is one; else the nearer end."""
    step = (high - low) / PARTS
    begin = torch.full_like(like, low)
    first = lacking(begin)

    def scan(carried: list[Tensor]) -> list[Tensor]:
        at, before, left, at_left, at_right, there = carried
        further = at + step
        value = lacking(further)
        crossed = (before * value <= 0) & ~there
        left = torch.where(crossed, at, left)
        at_left, at_right = torch.where(crossed, before, at_left), torch.where(crossed, value, at_right)
        return [further, value, left, at_left, at_right, there | crossed]

    no = torch.zeros_like(like, dtype=torch.bool)
    _, last, left, at_left, at_right, there = repeated(scan, [begin, first, begin, first, first, no], PARTS)

    # Regula falsi of Anderson & Björck (1973), as play has it.
    def narrow(carried: list[Tensor]) -> list[Tensor]:
        lower, at_lower, upper, at_upper = carried
        difference = at_upper - at_lower
        at = upper - at_upper * (upper - lower) / torch.where(difference == 0, 1.0, difference)
        at = torch.where(at_upper == 0, upper, at)
        value = lacking(at)
        crosses = value * at_upper < 0
        share = 1 - value / torch.where(at_upper == 0, 1.0, at_upper)
        share = torch.where(share > 0, share, 0.5)
        at_lower = torch.where(crosses, at_upper, at_lower * share)
        return [torch.where(crosses, upper, lower), at_lower, at, value]

    _, _, pressure, _ = repeated(narrow, [left, at_left, left + step, at_right], TURNS)
    nearer = torch.where(last.abs() < first.abs(), high, low)
    return torch.where(there, pressure, nearer), there


def _depends(graph: Any, nodes: Sequence[int], place: int) -> bool:
    return place in graph.inputs(nodes)


def _name(quantity: Quantity) -> str:
    return "diameter" if "diameter" in quantity.column else quantity.column.rsplit("_", 1)[0]


def _more(quantity: Quantity) -> str:
    return ": length less the length at rest" if quantity is ELONGATION else ", gauge" if quantity is PRESSURE else ""


def _about(quantity: Quantity) -> str:
    return {
        "force": "force on the mount, positive where the actuator pushes",
        "moment": "moment on the mount, positive where it turns towards positive twist",
    }.get(_name(quantity), _name(quantity))
