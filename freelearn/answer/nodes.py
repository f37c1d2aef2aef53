"""What a model gives at the nodes of a grid over the inputs that are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.answer.span import Span
from freelearn.answer.system import System
from freelearn.measurements.beds import PRESSURE, TWIST, Quantity
from freelearn.measurements.states import States
from freelearn.units import DEG

# Nodes along each input: as dense as the loads bend.
LENGTHS, PRESSURES, TWISTS = 13, 9, 17
# The turn that a twist's nodes are apart at most.
TURN = 20 * DEG
# Beyond so many evaluations a table over all inputs is made once for each actuator, and read between its nodes.
DIRECT = 150_000


@dataclass(frozen=True)
class Nodes:
    """axes: nodes of each input asked for, one (N, n) each, SI. outputs: there, (N, n₁, …, 2). exact: whether they are
    the model's own, and not read between the nodes of a table."""

    axes: list[Tensor]
    outputs: Tensor
    exact: bool


def nodes(system: System, x: Tensor, asked: Sequence[int], span: Span, exact: bool = False) -> Nodes:
    """Outputs over the inputs asked for, at the others as they are given in x (N, m). exact: not read from a table."""
    low, high = span.box(system)
    counts = [_count(q, float(b), float(a)) for q, a, b in zip(system.inputs, *span.looked, strict=True)]
    shares = [torch.linspace(0, 1, n, dtype=torch.float64) for n in counts]
    axes = [low[:, [i]] + shares[i] * (high - low)[:, [i]] for i in asked]
    evaluations = len(system)
    for i in asked:
        evaluations *= counts[i]
    if exact or evaluations <= DIRECT or system.states.members:
        parts = [
            _directly(system[rows], x[rows], asked, [axis[rows] for axis in axes])
            for rows in torch.arange(len(x)).split(max(DIRECT * len(x) // evaluations, 1))
        ]
        return Nodes(axes, torch.cat(parts), True)
    return Nodes(axes, _between(system, x, asked, shares, low, high), False)


def _count(quantity: Quantity, high: float, low: float) -> int:
    if quantity is TWIST:
        return max(TWISTS, int((high - low) / TURN) + 2)
    return PRESSURES if quantity is PRESSURE else LENGTHS


def _directly(system: System, x: Tensor, asked: Sequence[int], axes: Sequence[Tensor]) -> Tensor:
    """By the model at every node of every row."""
    shape = [axis.shape[1] for axis in axes]
    each = [axis.reshape(len(x), *[-1 if j == k else 1 for j in range(len(axes))]) for k, axis in enumerate(axes)]
    whole = x.reshape(len(x), *[1] * len(axes), -1).expand(-1, *shape, -1).clone()
    for i, axis in zip(asked, each, strict=True):
        whole[..., i] = axis.expand(len(x), *shape)
    count = whole[0, ..., 0].numel()
    rows = torch.arange(len(x)).repeat_interleave(count)
    return system[rows].at(whole.reshape(-1, x.shape[1])).loads.reshape(len(x), *shape, 2)


def _between(
    system: System, x: Tensor, asked: Sequence[int], shares: Sequence[Tensor], low: Tensor, high: Tensor
) -> Tensor:
    """From a table for each actuator, linearly between the nodes of the inputs that are given."""
    out = torch.empty(len(x), *[len(shares[i]) for i in asked], 2, dtype=torch.float64)
    for rows in _alike(system.states):
        table = _table(system[rows[:1]], shares, low[rows[:1]], high[rows[:1]])
        given = [i for i in range(x.shape[1]) if i not in asked]
        # The inputs given first, one after another taken away.
        table = table.permute(*given, *asked, table.ndim - 1)
        weights = [_places(shares[i], (x[rows, i] - low[rows, i]) / (high - low)[rows, i]) for i in given]
        for chunk in torch.arange(len(rows)).split(2048):
            out[rows[chunk]] = _read(table, [(k[chunk], w[chunk]) for k, w in weights])
    return out


def _alike(states: States) -> list[Tensor]:
    """Rows of one actuator. What else differs among them moves its loads a little: a start need not know that."""
    design = (states.sample.double(), states.fiber_angle, states.reference_length, states.inner_radius)
    _, group = torch.unique(torch.stack([*design, states.outer_radius], dim=-1), dim=0, return_inverse=True)
    return [torch.nonzero(group == g)[:, 0] for g in range(int(group.max()) + 1)]


def _table(one: System, shares: Sequence[Tensor], low: Tensor, high: Tensor) -> Tensor:
    grid = torch.stack(torch.meshgrid(*shares, indexing="ij"), dim=-1)
    x = (low + grid.reshape(-1, len(shares)) * (high - low)).contiguous()
    return one.repeated(len(x)).at(x).loads.reshape(*grid.shape[:-1], 2)


def _places(share: Tensor, value: Tensor) -> tuple[Tensor, Tensor]:
    """The node before each value, and how far on towards the next, beyond the ends too."""
    width = float(share[1])
    before = (value / width).floor().clamp(0, len(share) - 2).nan_to_num(0.0).long()
    return before, (value - share[before]) / width


def _read(table: Tensor, places: Sequence[tuple[Tensor, Tensor]]) -> Tensor:
    """A table (nodes of what is given …, nodes of what is asked …, 2) between the nodes of what is given."""
    if not places:
        return table[None].expand(1, *table.shape)
    first, weight = places[0]
    shape = (-1, *[1] * (table.ndim - len(places)))
    if len(places) == 1:
        return torch.lerp(table[first], table[first + 1], weight.reshape(shape))
    (a, u), (b, v) = places
    u, v = u.reshape(shape), v.reshape(shape)
    return torch.lerp(
        torch.lerp(table[a, b], table[a, b + 1], v), torch.lerp(table[a + 1, b], table[a + 1, b + 1], v), u
    )
