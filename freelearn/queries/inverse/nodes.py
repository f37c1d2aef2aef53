"""What a model gives at the nodes of a grid over the inputs that are asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from freelearn.data.beds import DEG, PRESSURE, TWIST, Quantity
from freelearn.physics.chain.prediction import Status
from freelearn.queries.inverse.system import Span, System

# Nodes along each input: as dense as the loads bend.
LENGTHS, PRESSURES, TWISTS = 13, 9, 17
# The turn that a twist's nodes are apart at most.
TURN = 20 * DEG
# Beyond so many evaluations a table over all inputs is made once for each actuator, and read between its nodes: over
# the inputs that are given with so many times as many of them, for what it is wrong by may hide an answer.
DIRECT, FINER = 150_000, 4
ROWS = 1024


@dataclass(frozen=True)
class Nodes:
    """axes: nodes of each input asked for, one (n, k) each, SI. outputs: those that are given there, (n, k₁, …, b), NaN
    without an equilibrium."""

    axes: list[Tensor]
    outputs: Tensor


@dataclass(frozen=True)
class Grid:
    """The nodes of N rows of a system, over the inputs asked for, at the others as they stand in x (N, m).

    given: the outputs that are told there. always_exact: whether they are the model's own however many they are, and
    never read from a table."""

    system: System
    x: Tensor
    asked: Sequence[int]
    given: Sequence[int]
    span: Span
    always_exact: bool = False

    @cached_property
    def shares(self) -> list[Tensor]:
        """Places of the nodes along each input, from 0 to 1."""
        limits = zip(self.system.inputs, *self.span.looked, strict=True)
        counts = [_count(quantity, float(high - low)) for quantity, low, high in limits]
        return [torch.linspace(0, 1, n, dtype=torch.float64) for n in counts]

    @cached_property
    def size(self) -> Tensor:
        """Of a cell, along each input asked for, (N, a)."""
        low, high = self.span.box(self.system)
        counts = torch.tensor([len(self.shares[i]) - 1 for i in self.asked])
        return (high - low)[:, list(self.asked)] / counts

    @property
    def nodes_a_row(self) -> int:
        """How many there are in each row."""
        return math.prod(len(self.shares[i]) for i in self.asked)

    @property
    def exact(self) -> bool:
        """Whether the outputs are the model's own."""
        several = bool(self.system.states.members)
        return self.always_exact or several or len(self.x) * self.nodes_a_row <= DIRECT

    def parts(self, some: Tensor | None = None) -> Iterator[tuple[Tensor, Nodes]]:
        """Rows (n,) int64 with their nodes, a few at a time: what is compared then stays in the processor's cache.

        some: of these rows alone, (m,) int64."""
        low, high = self.span.box(self.system)
        for rows in (torch.arange(len(self.x)) if some is None else some).split(ROWS):
            between = high[rows] - low[rows]
            axes = [low[rows][:, [i]] + self.shares[i] * between[:, [i]] for i in self.asked]
            outputs = self._own(rows, axes) if self.exact else self._read(rows, low, high)
            yield rows, Nodes(axes, outputs if len(self.given) == 2 else outputs[..., list(self.given)])

    def _own(self, rows: Tensor, axes: Sequence[Tensor]) -> Tensor:
        """By the model at every node of every row."""
        x, shape = self.x[rows], [axis.shape[1] for axis in axes]
        whole = x.reshape(len(x), *[1] * len(axes), -1).expand(-1, *shape, -1).clone()
        for k, (i, axis) in enumerate(zip(self.asked, axes, strict=True)):
            across = [-1 if j == k else 1 for j in range(len(axes))]
            whole[..., i] = axis.reshape(len(x), *across).expand(len(x), *shape)
        each = rows.repeat_interleave(self.nodes_a_row)
        return _told(self.system[each], whole.reshape(-1, x.shape[1])).reshape(len(x), *shape, 2)

    def _read(self, rows: Tensor, low: Tensor, high: Tensor) -> Tensor:
        """From a table for each actuator, linearly between the nodes of the inputs that are given."""
        out = torch.empty(len(rows), *[len(self.shares[i]) for i in self.asked], 2, dtype=torch.float64)
        given = [i for i in range(self.x.shape[1]) if i not in self.asked]
        actuator = self._actuator[rows]
        for number in torch.unique(actuator).tolist():
            inside = torch.nonzero(actuator == number)[:, 0]
            at = rows[inside]
            share = (self.x[at] - low[at]) / (high[at] - low[at])
            places = [_places(self._finer[i], share[:, i]) for i in given]
            # The inputs given first, one after another taken away.
            table = self._tables[number]
            out[inside] = _between(table.permute(*given, *self.asked, table.ndim - 1), places)
        return out

    @cached_property
    def _actuator(self) -> Tensor:
        """Number of each row's actuator, (N,). What else differs among its rows moves its loads a little: a start need
        not know that."""
        states = self.system.states
        design = (states.sample.double(), states.fiber_angle, states.reference_length, states.inner_radius)
        number: Tensor
        _, number = torch.unique(torch.stack([*design, states.outer_radius], dim=-1), dim=0, return_inverse=True)
        return number

    @cached_property
    def _finer(self) -> list[Tensor]:
        """Places of a table's nodes along each input: more of them along those that are given."""
        more = [n if i in self.asked else FINER * (n - 1) + 1 for i, n in enumerate(map(len, self.shares))]
        return [torch.linspace(0, 1, n, dtype=torch.float64) for n in more]

    @cached_property
    def _tables(self) -> list[Tensor]:
        """Each actuator's outputs at all nodes of all inputs, (k₁, …, 2)."""
        low, high = self.span.box(self.system)
        places = torch.stack(torch.meshgrid(*self._finer, indexing="ij"), dim=-1)
        tables = []
        for number in range(int(self._actuator.max()) + 1):
            row = torch.nonzero(self._actuator == number)[:1, 0]
            x = low[row] + places.reshape(-1, len(self._finer)) * (high - low)[row]
            tables.append(_told(self.system[row].repeated(len(x)), x).reshape(*places.shape[:-1], 2))
        return tables


def _told(system: System, x: Tensor) -> Tensor:
    """Outputs (n, 2) at inputs (n, m), NaN without an equilibrium."""
    outputs, status = system.at(x)
    return torch.where((status == Status.NO_EQUILIBRIUM)[:, None], torch.nan, outputs)


def _count(quantity: Quantity, span: float) -> int:
    if quantity is TWIST:
        return max(TWISTS, int(span / TURN) + 2)
    return PRESSURES if quantity is PRESSURE else LENGTHS


def _places(share: Tensor, value: Tensor) -> tuple[Tensor, Tensor]:
    """The node before each value, and how far on towards the next, beyond the ends too."""
    width = float(share[1])
    before = (value / width).floor().clamp(0, len(share) - 2).nan_to_num(0.0).long()
    return before, (value - share[before]) / width


def _between(table: Tensor, places: Sequence[tuple[Tensor, Tensor]]) -> Tensor:
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
