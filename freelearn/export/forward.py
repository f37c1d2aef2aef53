"""What is known where something is imposed on an actuator, as one function: answer, derivatives, bands and flags."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD, INFLATION, Bed
from freelearn.export.actuator import NEXT, WORST, Actuator
from freelearn.export.arithmetic.function import Function, Port, pruned
from freelearn.export.arithmetic.trace import traced
from freelearn.physics.chain.prediction import Status
from freelearn.physics.chain.row_derivatives import determinant
from freelearn.queries.inverse.bands import SAME
from freelearn.queries.inverse.miss import Miss
from freelearn.queries.inverse.system import System

STATUS = "; ".join(f"{int(s)} {s.name.lower()}" for s in Status)
# Of a bed: the answer alone, its derivatives, its bands.
LOADS = ("loads", "stiffness", "band")
NAMES = {
    DEAD_LOAD.name: ("place", "compliance", "place_band"),
    INFLATION.name: ("swelling", "swelling_rates", "swelling_band"),
}
ABOUT = {
    "loads": "force and moment at a place",
    "place": "where the actuator comes to rest under loads",
    "swelling": "force and outer diameter at a place",
    "stiffness": "derivatives of the loads: the stiffness with its sign turned, and what pressure adds",
    "compliance": "derivatives of the place: the compliance, and what pressure moves",
    "swelling_rates": "derivatives of the force and the outer diameter",
}
BAND = "half of the 95 % band for a new measurement"


def names(bed: Bed) -> tuple[str, str, str]:
    """Of the functions of a bed's answer, of its derivatives and of its bands."""
    return NAMES.get(bed.name, LOADS)


def forward(actuator: Actuator) -> Function:
    """Everything that is known at what is imposed: answer, derivatives, bands, and whether to trust them."""
    known = _hung(actuator) if actuator.held and actuator.bed is DEAD_LOAD else _direct(actuator)
    ports, count = (*actuator.imposed, *actuator.memory), len(actuator.imposed)
    graph, nodes = traced(known, len(ports), f"Model {actuator.fitted.title}")
    answered = actuator.answered
    out = [
        *answered,
        Port("status", "1", f"what the model says of the row: {STATUS}"),
        Port("inside", "1", "1 where the data that the model was fitted on reach, 0 beyond: nothing is promised there"),
        *(
            Port(f"d_{y.name}_by_{x.name}", f"{y.unit}/({x.unit})", f"derivative of the {y.name} by the {x.name}")
            for y in answered
            for x in actuator.imposed
        ),
    ]
    if actuator.fitted.bands:
        out += [Port(f"{y.name}_half_band", y.unit, f"half of the 95 % band of the {y.name}") for y in answered]
    several = max(len(actuator.states.members), 1)
    flat = [i for some in nodes[:-several] for i in some]
    used = graph.inputs(flat)
    # What remembers nothing hands nothing on.
    for place, port, node in zip(range(several), actuator.memory[-several:], nodes[-several:], strict=True):
        if len(ports) - several + place in used:
            out.append(Port(port.name.replace(WORST, NEXT), "1", f"{port.name} of the next call"))
            flat += node
    inputs = pruned(graph, [flat], ports, count)
    about = f"{ABOUT[names(actuator.bed)[0]]}, with derivatives, bands and flags"
    return Function("forward", about, inputs, tuple(out), graph, tuple(flat))


def parts(actuator: Actuator, whole: Function) -> list[Function]:
    """The functions of a bed, each with what it needs alone: the answer, its derivatives, its bands."""
    first, second, third = names(actuator.bed)
    there = [p.name for p in whole.outputs]
    flags, after = ["status", "inside"], [n for n in there if n.startswith(NEXT)]
    rates, bands = [n for n in there if n.startswith("d_")], [n for n in there if n.endswith("_half_band")]
    answered = [p.name for p in actuator.answered]
    found = [
        whole.part(first, ABOUT[first], [*answered, *flags, *after]),
        whole.part(second, ABOUT[second], [*rates, *flags]),
    ]
    return [*found, whole.part(third, BAND, [*bands, *flags])] if bands else found


def _direct(actuator: Actuator) -> Callable[..., Sequence[Tensor]]:
    """Answers that the model gives at what is imposed."""
    bands, values, edges, shown = actuator.fitted.bands, actuator.system.values, actuator.edges, actuator.shown
    _ = edges, actuator.rest
    factors = bands.miss.factors((), (0, 1), SAME) if bands else None
    banded = Banded.from_miss(bands.miss, actuator.system) if bands else None

    def known(*inputs: Tensor) -> Sequence[Tensor]:
        system, x, worst = actuator.place(inputs)
        answer, status = system.recorded(x, values)
        slopes = system.recorded_slopes(x, values)[1]
        found = [answer[:, shown], status.to(torch.float64), actuator.inside(x).to(torch.float64), slopes[:, shown]]
        if banded is not None and bands is not None and factors is not None:
            half = factors * banded.deviations(system, x, slopes)
            if actuator.bed is INFLATION and actuator.held:
                half = torch.stack([half[:, 0], torch.full_like(half[:, 0], bands.diameter)], dim=-1)
            found.append(half[:, shown])
        return [*found, *worst]

    return known


def _hung(actuator: Actuator) -> Callable[..., Sequence[Tensor]]:
    """Places at which the actuator comes to rest under loads: the model's own search, with a fixed number of steps."""
    held, bands, values = actuator.held, actuator.fitted.bands, actuator.system.values
    assert held is not None
    _ = actuator.edges, held.edges, actuator.rest, held.rest, actuator.states, held.states
    factors = bands.miss.factors((0, 1), (0, 1), SAME)[:2] if bands else None
    banded = Banded.from_miss(bands.miss, held.system) if bands else None

    def known(*inputs: Tensor) -> Sequence[Tensor]:
        system, x, worst = actuator.place(inputs)
        answer, status = system.recorded(x, values)
        # The same row with its place imposed: derivatives by the implicit function theorem.
        still = type(system)(system.model, system.states.replace(bed=held.bed))
        at = actuator.rested(x, answer)
        slopes = still.recorded_slopes(at, values)[1]
        yields = inverted(slopes[:, :, :2])
        rates = torch.cat([yields, -yields @ slopes[:, :, 2:]], dim=-1)
        inside = actuator.inside(x) & held.inside(at)
        found = [answer, status.to(torch.float64), inside.to(torch.float64), rates]
        if banded is not None and factors is not None:
            found.append(factors * banded.deviations(still, at, slopes, -yields))
        return [*found, *worst]

    return known


def inverted(m: Tensor) -> Tensor:
    """m⁻¹ of every row, (N, 2, 2)."""
    first = torch.stack([m[:, 1, 1], -m[:, 0, 1]], dim=-1)
    second = torch.stack([-m[:, 1, 0], m[:, 0, 0]], dim=-1)
    return torch.stack([first, second], dim=1) / determinant(m)[:, None, None]


@dataclass(frozen=True)
class Banded:
    """own (2, 2): covariance that is the same everywhere, of the readings and of what the model misses. errors (m,):
    one standard deviation of each input. matrix (p, p): of the model's raw vector, None where nothing is known of it.
    unknown (u,) int64: its numbers that nobody knows."""

    own: Tensor
    errors: Tensor
    matrix: Tensor | None
    unknown: Tensor

    @classmethod
    def from_miss(cls, miss: Miss, system: System) -> Banded:
        """As a fitted model's bands have it."""
        own, errors = miss.beyond, torch.zeros(len(system.inputs), dtype=torch.float64)
        if miss.accuracy is not None:
            readings = [getattr(miss.accuracy, q.error) for q in system.bed.readings]
            own = own + torch.diag(torch.tensor(readings, dtype=torch.float64) ** 2)
            errors = torch.tensor([getattr(miss.accuracy, q.error) for q in system.inputs], dtype=torch.float64)
        matrix = None if miss.parameters.silent else miss.parameters.matrix
        return cls(own, errors, matrix, torch.nonzero(miss.parameters.undetermined)[:, 0])

    def deviations(self, system: System, x: Tensor, slopes: Tensor, maps: Tensor | None = None) -> Tensor:
        """One standard deviation of what a new measurement is off by, of each output (1, 2), or of what maps (1, k, 2)
        make of both, (1, k); NaN where nobody knows. slopes: (1, 2, m) at x."""
        spread = slopes * self.errors
        total = self.own + spread @ spread.transpose(1, 2)
        lost = torch.zeros(1, 2, dtype=torch.bool)
        if self.matrix is not None:
            rate = _by_parameters(system, x)
            total = total + rate @ self.matrix @ rate.transpose(1, 2)
            if len(self.unknown):
                lost = (rate[:, :, self.unknown].abs() > 0).any(-1)
        if maps is not None:
            total = maps @ total @ maps.transpose(1, 2)
            lost = ((maps != 0) & lost[:, None, :]).any(-1)
        variance = torch.diagonal(total, dim1=-2, dim2=-1)
        return torch.where(lost, torch.nan, variance.clamp_min(0).sqrt())


def _by_parameters(system: System, x: Tensor) -> Tensor:
    """As System.by_parameters, (1, 2, p), in a trace."""
    vector = system.model.vector().detach()
    copies = (vector + 0.0 * x[:, :1]).detach().requires_grad_()
    with torch.enable_grad():
        states = system.states.with_inputs(x.detach().unbind(-1))
        y = system.model.chain(states, system.model.physical(copies)).loads
        each = [
            torch.autograd.grad(y[:, i].sum(), copies, retain_graph=True, materialize_grads=True)[0] for i in (0, 1)
        ]
    return torch.stack(each, dim=1)
