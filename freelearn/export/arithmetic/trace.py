"""A function of one row's tensors as a graph of numbers, its searches with a fixed number of turns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import torch
from torch import Tensor, addcmul
from torch._decomp import core_aten_decompositions
from torch._subclasses.fake_tensor import FakeTensorMode
from torch.fx.experimental.proxy_tensor import make_fx

from freelearn.common.errors import UserError
from freelearn.data.states import States
from freelearn.export.arithmetic.graph import Graph
from freelearn.export.arithmetic.loops import repeated
from freelearn.export.arithmetic.lower import Lowering, NotArithmetic
from freelearn.physics.chain import dead_load, mount
from freelearn.physics.chain.row_derivatives import determinant, divide, rows_jacobian
from freelearn.physics.mechanics import equilibrium
from freelearn.physics.mechanics.wall import Wall

# The searches inside a model with a fixed number of turns, for the time of a trace.
#
# The model's own searches stop when all rows have settled, which is a branch. These go on, from the same starts by
# the same steps, and end in the same places: what they find is polished by the models' own differentiable steps.

# Turns of each search. The certificate of every export finds out whether they were enough: rows that do not settle are
# told as without equilibrium.
HALLEY, BRACKET, MOUNT, HANG = 12, 40, 12, dead_load.MAX_ITERATIONS


@contextmanager
def fixed_searches() -> Iterator[None]:
    """Inside of it, models search a fixed number of turns."""
    with ExitStack() as stack:
        stack.enter_context(patch.object(equilibrium, "_solve", _inflated))
        stack.enter_context(patch.object(mount, "_solve", _mounted))
        stack.enter_context(patch.object(dead_load, "_solve", _hung))
        yield


def _inflated(wall: Wall, reference: Tensor, start: Tensor, pressure: Tensor, near: bool) -> tuple[Tensor, Tensor]:
    """As equilibrium._solve."""
    ceiling = (equilibrium.BALLOON**2 * reference).expand_as(pressure)
    start = start.expand_as(pressure)
    search = _halley if wall.stiffens else _bracketed
    return search(wall, reference, start, ceiling, pressure)


def _halley(
    wall: Wall, reference: Tensor, start: Tensor, ceiling: Tensor, pressure: Tensor
) -> tuple[Tensor, Tensor]:  # fmt: skip
    """As equilibrium._halley."""
    growth = equilibrium.HALLEY_GROWTH

    def turn(carried: list[Tensor]) -> list[Tensor]:
        (u, _) = carried
        expansion = wall.expansion(u)
        lack, rise = pressure - expansion.pressure, expansion.rise
        square = rise * rise
        square = torch.maximum(addcmul(square, lack, expansion.bend, value=0.5), 0.5 * square)
        step = (lack * rise / square).clamp(1 / growth - 1, growth - 1)
        target = torch.minimum(addcmul(u, u, step), ceiling)
        return [target, (target - u).abs() <= equilibrium.HALLEY_TOLERANCE * u]

    u, settled = repeated(turn, [start, torch.zeros_like(start, dtype=torch.bool)], HALLEY)
    return u, settled & (u < ceiling)


def _bracketed(
    wall: Wall, reference: Tensor, start: Tensor, ceiling: Tensor, pressure: Tensor
) -> tuple[Tensor, Tensor]:  # fmt: skip
    """As equilibrium._search."""
    growth = equilibrium.NEWTON_GROWTH

    def turn(carried: list[Tensor]) -> list[Tensor]:
        u, low, high, lost, _ = carried
        value, slope = wall.carried(u)
        excess = value - pressure
        short = excess < 0
        lost = lost | (short & ((u >= ceiling) | ((slope <= 0) & (u > reference))))
        low, high = torch.where(short, u, low), torch.where(short, high, u)
        newton = torch.minimum(torch.maximum(u - excess / slope, u / growth), u * growth)
        target = torch.where(slope > 0, newton, (low + high) / 2)
        target = torch.maximum(torch.minimum(target, high), low)
        return [target, low, high, lost, lost | ((target - u).abs() <= equilibrium.NEWTON_TOLERANCE * u)]

    no = torch.zeros_like(start, dtype=torch.bool)
    u, _, _, lost, done = repeated(turn, [start, 1e-4 * ceiling, ceiling, no, no], BRACKET)
    balanced = done & ~lost
    return torch.where(balanced, u, ceiling), balanced


def _mounted(
    states: States, values: mount.Values, impose: mount.Impose, loads: mount.Loads, rows_of: mount.RowsOf
) -> mount._Solution:
    """As mount._solve."""
    size = mount._size(states)
    largest = size * torch.tensor(mount.LARGEST, dtype=size.dtype)
    identity = mount._identity(size)

    def turn(carried: list[Tensor]) -> list[Tensor]:
        q = carried[0]
        held, stiffness = rows_jacobian(
            lambda at: loads(states.replace(length=at[:, 0], twist=at[:, 1]), values).loads, q
        )
        imposed, yielding = rows_jacobian(lambda given: mount._place(impose(states, given, values)), held)
        jacobian = identity - yielding @ stiffness
        step = -divide(q - imposed, jacobian)
        settled = (step.abs() <= mount.TOLERANCE * size).all(-1)
        step = torch.where(settled[:, None], 0.0, torch.minimum(torch.maximum(step, -largest), largest))
        return [q + step, jacobian, stiffness, settled]

    zero = torch.zeros_like(size)[:, :, None].expand(-1, -1, 2)
    no = torch.zeros_like(states.length, dtype=torch.bool)
    q, jacobian, stiffness, settled = repeated(turn, [mount._place(states), zero, zero, no], MOUNT)
    return mount._Solution(q, jacobian, stiffness, settled & (determinant(jacobian) > 0), torch.zeros_like(q[:, 0]))


def _hung(
    states: States, values: dead_load.Values, loads: dead_load.Loads, rows_of: dead_load.RowsOf
) -> dead_load._Rest:
    """As hang._solve."""
    size = torch.stack([states.reference_length, torch.ones_like(states.length)], dim=-1)
    largest = torch.tensor(dead_load.LARGEST, dtype=size.dtype).expand_as(size)
    bounds = torch.tensor(dead_load.RANGE, dtype=size.dtype)
    weight = torch.stack([states.force, states.moment], dim=-1)

    def turn(carried: list[Tensor]) -> list[Tensor]:
        q, reach, before, _, _, turns = carried
        # Those that have not settled early begin anew from where they are.
        anew = turns == dead_load.EARLY
        reach = torch.where(anew[:, None], largest, reach)
        before = torch.where(anew, -1.0, before)
        shown, rate = rows_jacobian(lambda at: loads(dead_load._moved(states, at), values).loads, q)
        excess, stiffness = (shown - weight) * size, -rate * size[:, :, None] * size[:, None, :]
        followed, stable = dead_load._positive(stiffness)
        step = divide(excess, followed)
        settled = (step.abs() <= dead_load.TOLERANCE).all(-1) & stable
        far = excess.square().sum(-1).sqrt()
        shorter = torch.where((far > before)[:, None], reach / 2, torch.minimum(1.5 * reach, largest))
        # On the first turn nothing went before.
        reach = torch.where((before < 0)[:, None], reach, shorter)
        scaled = torch.minimum(torch.maximum(step, -reach), reach)
        moved = size * torch.minimum(torch.maximum(q / size + scaled, bounds[:, 0]), bounds[:, 1])
        return [torch.where(settled[:, None], q, moved), reach, far, -rate, settled, turns + 1]

    # Of the trace's own tensors, as all that is carried.
    count = 0.0 * states.force
    none, no = count - 1.0, torch.zeros_like(count, dtype=torch.bool)
    zero = torch.zeros_like(weight)[:, :, None].expand(-1, -1, 2)
    place = torch.stack([states.length, states.twist], dim=-1) + count[:, None]
    begin = [place, largest + count[:, None], none, zero, no, count]
    q, _, _, stiffness, settled, _ = repeated(turn, begin, HANG)
    return dead_load._Rest(q, stiffness, settled)


# A function of one row's tensors as a graph of numbers.


def traced(function: Callable[..., Sequence[Tensor]], inputs: int, what: str) -> tuple[Graph, list[list[int]]]:
    """The function of so many numbers, each (1,), as a graph, and the nodes of each of its outputs.

    Nothing in it may depend on what the numbers are: where the model asks, the answer is that nobody can know
    (freelearn.common.vmapped). Raises UserError where it cannot be written as arithmetic; what: its name in the
    sentence."""
    graph = Graph()
    places = [torch.tensor([graph.input(i)], dtype=torch.int64) for i in range(inputs)]
    mode = FakeTensorMode(allow_non_fake_inputs=True)
    rows = [mode.from_tensor(torch.ones(1, dtype=torch.float64)) for _ in range(inputs)]
    try:
        with fixed_searches(), torch.no_grad():
            # A mapping, whatever its declared type says.
            simpler: Any = core_aten_decompositions()
            module = make_fx(function, decomposition_table=simpler)(*rows)
        outputs = Lowering(graph, module).outputs(places)
    except (NotArithmetic, RuntimeError, TypeError) as problem:
        first = str(problem).strip().splitlines()[0] if str(problem).strip() else type(problem).__name__
        raise UserError(
            f"{what} cannot be exported: it does what no straight-line arithmetic can ({first}); use predict."
        ) from problem
    return graph, [t.reshape(-1).tolist() for t in outputs]
