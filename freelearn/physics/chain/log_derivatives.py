"""Derivatives of what is shown along a log: its steady middle row by row, in reverse, and the rest forward."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.history import (
    BLOCK,
    Chain,
    Stage,
    before_sensors,
    bridged,
    carried,
    flickering,
    stages,
    supplied,
    without,
)
from freelearn.physics.chain.ports import HistoryEffect
from freelearn.physics.chain.prediction import Status
from freelearn.physics.chain.raw_vector import Values

# Samples times derivatives that are carried along at once.
TOGETHER = 4_000_000
# Samples below which the number of operations counts and not their size.
FEW = 5000
# Of a value and its derivative: no direction changes the value, which is made once for all of them.
ONCE: Any = (None, 0)
# Derivatives by parameters, by their places in the raw vector, of what every sample shows: (M, 2). None of the others.
Rates = dict[int, Tensor]


def log_jacobian(chain: Chain, states: States, vector: Tensor, wanted: Collection[int] | None = None) -> Tensor:
    """∂loads/∂vector of rows of a log as they were recorded, at a raw vector (p,): (N, 2, p).

    Each parameter is carried along from where it first moves anything. wanted: places of those that are asked for (all
    of them); of others the derivative is zero.
    """
    assert states.recording is not None
    assert states.place is not None
    recording, place = states.recording.around(states.place)
    labels, asked = chain.labels(), range(len(vector)) if wanted is None else sorted(wanted)

    def owned(effects: Sequence[HistoryEffect[Any]]) -> list[int]:
        """Places of the effects' parameters in the raw vector."""
        names = tuple(f"{effect.name}." for effect in effects)
        return [i for i in asked if labels[i].startswith(names)]

    def head(v: Tensor) -> Tensor:
        return torch.stack(supplied(chain, recording, chain.physical(v)), dim=-1)

    unit = torch.eye(len(vector), dtype=vector.dtype, device=vector.device)
    # Of all parameters those of the effects before the wall alone move what it balances.
    before = owned([*chain.history["supply"], *chain.history["wall"]])
    inputs, heads = _with_rates(head, (vector,), len(recording), unit[before])
    by_head = dict(zip(before, heads, strict=True))
    remembering = owned([effect for effects in chain.history.values() for effect in effects])
    steady = [i for i in asked if i not in remembering]
    loads, rates, lost = _steady_rates(chain, recording.states, inputs, vector, steady, by_head)
    recording = flickering(chain, recording, inputs.unbind(-1), loads, chain.physical(vector))
    lost = without(loads, lost)
    some, begun = bool(lost.any()), rates
    if some:
        loads, rates = (
            bridged(recording, loads, lost),
            {i: bridged(recording, rate, lost) for i, rate in rates.items()},
        )
    for stage in stages(chain, recording):
        own = steady if stage.effect is None else owned([stage.effect])
        loads, rates = _onwards(chain, stage, loads, rates, vector, own)
    shown = loads.new_zeros(len(place), 2, len(vector))
    for i, rate in rates.items():
        if some:
            rate = torch.where(lost[:, None], begun.get(i, torch.zeros_like(rate)), rate)
        shown[..., i] = rate[place]
    return shown


def _onwards(
    chain: Chain, stage: Stage, loads: Tensor, rates: Rates, vector: Tensor, own: Sequence[int]
) -> tuple[Tensor, Rates]:
    """Loads (M, 2) and their rates after a stage with parameters of its own, from those before it."""
    values = chain.physical(vector)
    # Sensors that show what there is change nothing.
    if stage.effect is None and stage.of(loads, values) is loads:
        return loads, rates

    # Of few samples every operation costs the same however many columns there are.
    both = sorted({*own, *rates}) if len(loads) < FEW else list(own)
    only = [i for i in rates if i not in both]
    still = torch.zeros_like(loads)
    unit = torch.eye(len(vector), dtype=vector.dtype, device=vector.device)
    after, found = _with_rates(
        lambda of, v: stage.of(of, chain.physical(v)), (loads, vector), len(loads),
        [rates.get(i, still) for i in both], unit[both],
    )  # fmt: skip
    if only:
        found += _with_rates(lambda of: stage.of(of, values), (loads,), len(loads), [rates[i] for i in only])[1]
    return after, dict(zip([*both, *only], found, strict=True))


def _with_rates(
    f: Callable[..., Tensor], at: tuple[Tensor, ...], samples: int, *along: Sequence[Tensor] | Tensor
) -> tuple[Tensor, list[Tensor]]:
    """What f of a log is at a place, and its derivatives in several directions; along: of each of `at`, so many."""

    def both(*direction: Tensor) -> tuple[Tensor, Tensor]:
        shown = torch.func.jvp(f, at, direction)
        return shown[0], shown[1]

    if not len(along[0]):
        return f(*at), []
    some = max(1, TOGETHER // samples)
    found: list[Tensor] = []
    for first in range(0, len(along[0]), some):
        now = [torch.stack(list(each[first : first + some])) for each in along]
        value, rates = torch.func.vmap(both, out_dims=ONCE)(*now)
        found += rates.unbind(0)
    return value, found


def _rate(f: Callable[[Tensor], Tensor], at: Tensor, along: Tensor) -> Tensor:
    """Derivative of a function at a place in a direction."""
    rate: Tensor = torch.func.jvp(f, (at,), (along,))[1]
    return rate


def _each(f: Callable[[Tensor], Tensor], samples: int, columns: Tensor) -> list[Tensor]:
    """f of every column of a log, as many at once as memory allows: what none of them changes is made once for all."""
    return [rate for some in columns.split(max(1, TOGETHER // samples)) for rate in torch.func.vmap(f)(some).unbind(0)]


@torch.no_grad()
def shifted(chain: Chain, states: States, values: Values) -> Tensor:
    """∂readings/∂ what a whole recording is shifted by, in either quantity of a kinematic state, of rows of a log:
    (N, 2, 2). What is steady would be another value at every row, which a wall or friction carries on."""
    assert states.recording is not None
    assert states.place is not None
    recording, place = states.recording.around(states.place)
    inputs = torch.stack(supplied(chain, recording, values), dim=-1)
    whole, by, lost = _steady_by_inputs(chain, recording.states, inputs, values)
    recording = flickering(chain, recording, inputs.unbind(-1), whole, values)
    by = by[:, :, :2]

    first, second, *others = recording.states.inputs()

    def tail(of: Tensor, shift: Tensor) -> Tensor:
        moved = recording.states.with_inputs([first + shift[0], second + shift[1], *others])
        return carried(chain, recording.with_states(moved), of, values, lost)

    still, unit = whole.new_zeros(2), torch.eye(2, dtype=whole.dtype)
    columns = [torch.func.jvp(tail, (whole, still), (by[:, :, i], unit[i]))[1] for i in range(2)]
    return torch.stack(columns, dim=-1)[place]


@torch.no_grad()
def by_inputs(chain: Chain, recording: Recording[States], values: Values, samples: Tensor, quantity: int) -> Tensor:
    """∂readings/∂ one input of some samples of one recording, as its other samples stay: (M, 2, n).

    samples: (n,) int64; quantity: which of States.inputs. What the chain knows of a row besides (the direction in which
    its pressure went) stays.
    """
    inputs = torch.stack(recording.states.inputs(), dim=-1)

    def moved(x: Tensor) -> Recording[States]:
        return recording.with_states(recording.states.with_inputs(x.unbind(-1)))

    def head(x: Tensor) -> Tensor:
        return torch.stack(supplied(chain, moved(x), values), dim=-1)

    def tail(of: Tensor, x: Tensor) -> Tensor:
        return carried(chain, moved(x), of, values, lost)

    given = head(inputs)
    loads, by, lost = _steady_by_inputs(chain, recording.states, given, values)
    recording = flickering(chain, recording, given.unbind(-1), loads, values)
    places = torch.arange(len(recording), device=inputs.device)

    def column(sample: Tensor) -> Tensor:
        unit = (places == sample).to(inputs.dtype)
        pushed = torch.stack([unit if i == quantity else 0 * unit for i in range(inputs.shape[1])], dim=-1)
        rate = (by @ _rate(head, inputs, pushed)[..., None])[..., 0]
        shown: Tensor = torch.func.jvp(tail, (loads, inputs), (rate, pushed))[1]
        return shown

    return torch.stack(_each(column, len(recording), samples), dim=-1)


def _steady_by_inputs(chain: Chain, states: States, inputs: Tensor, values: Values) -> tuple[Tensor, Tensor, Tensor]:
    """Loads (M, 2) of every sample by itself at inputs (M, i), and ∂loads/∂inputs (M, 2, i): zero where it has none;
    whether it has no equilibrium (M,) bool."""
    loads, rates, lost = [], [], []
    for rows in torch.arange(len(states), device=inputs.device).split(BLOCK):
        with torch.enable_grad():
            at = inputs[rows].detach().requires_grad_()
            found = before_sensors(chain, states[rows].with_inputs(at.unbind(-1)), values)
            each = [torch.autograd.grad(f.sum(), at, retain_graph=True)[0] for f in found.loads.unbind(-1)]
        loads.append(found.loads.detach())
        lost.append(found.status == Status.NO_EQUILIBRIUM)
        rates.append(torch.stack(each, dim=1).nan_to_num(nan=0.0, posinf=0.0, neginf=0.0))
    return torch.cat(loads), torch.cat(rates), torch.cat(lost)


def _steady_rates(
    chain: Chain, states: States, inputs: Tensor, vector: Tensor, steady: Sequence[int], by_head: Mapping[int, Tensor]
) -> tuple[Tensor, Rates, Tensor]:
    """Loads (M, 2) of every sample by itself at inputs (M, i), and their rates; whether it has no equilibrium
    (M,) bool.

    steady: parameters of what is steady. by_head: ∂inputs/∂ of others, (M, i) each.
    """
    moving = [k for k in range(inputs.shape[1]) if any(bool(by[:, k].any()) for by in by_head.values())]
    loads, rates, lost = [], [], []
    for rows in range(0, len(states), BLOCK):
        some = slice(rows, rows + BLOCK)
        each = list(inputs[some].unbind(-1))
        for k in moving:
            each[k] = each[k].detach().requires_grad_()
        copies = vector.detach().expand(len(each[0]), -1).clone().requires_grad_(bool(steady))
        leaves = [*([copies] if steady else []), *(each[k] for k in moving)]
        with torch.set_grad_enabled(bool(leaves)):
            found = before_sensors(chain, states[some].with_inputs(each), chain.physical(copies))
            by = [
                torch.autograd.grad(f.sum(), leaves, retain_graph=True, materialize_grads=True)
                for f in found.loads.unbind(-1)
                if leaves
            ]
        by_leaves = [torch.stack(pair, dim=1) for pair in zip(*by, strict=True)]
        by_inputs = by_leaves[1:] if steady else by_leaves
        own = dict(zip(steady, by_leaves[0][..., steady].unbind(-1), strict=True)) if steady else {}
        for i, head in by_head.items():
            pushed = [b.nan_to_num(nan=0.0) * head[some, k, None] for k, b in zip(moving, by_inputs, strict=True)]
            own[i] = sum(pushed, start=torch.zeros_like(found.loads.detach()))
        loads.append(found.loads.detach())
        rates.append(own)
        lost.append(found.status == Status.NO_EQUILIBRIUM)
    joined = {i: torch.cat([r[i] for r in rates]) for i in rates[0]}
    return torch.cat(loads), joined, torch.cat(lost)
