"""The chain along a log: what effects of the history carry from sample to sample of whole recordings.

pressure (and hung loads) → `supply`, `wall` undone → the chain of every sample by itself → `wall`, `loads` carried →
sensors → `readings` carried. Only the steady middle is costly, and it knows no time: so a fit's derivatives take it
row by row, in reverse, and go through the rest forward.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import torch
from torch import Tensor

from freelearn.common.vmapped import all_if_known
from freelearn.data.beds import DEAD_LOAD
from freelearn.data.recordings import Recording, recurred
from freelearn.data.states import States
from freelearn.physics.chain.ports import HistoryEffect
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.physics.chain.raw_vector import Values

# Rows of the steady chain at once (as chain has them).
BLOCK = 4096
# Samples times derivatives that are carried along at once.
TOGETHER = 3_000_000


class Chain(Protocol):
    """What is asked of a chain.Chain."""

    weights: dict[str, tuple[int, ...]]
    # Effects of the history by what they act on.
    history: dict[str, list[HistoryEffect[Any]]]

    def labels(self) -> list[str]:
        """As RawVector.labels."""

    def physical(self, vector: Tensor) -> Values:
        """As RawVector.physical."""

    def steady(self, states: States, values: Values) -> Prediction:
        """As Chain.steady."""

    def straight(self, states: States, values: Values) -> Prediction:
        """As Chain.straight."""

    def evaded(self, loads: Tensor, states: States, values: Values) -> Tensor:
        """As Chain.evaded."""

    def sensed(self, loads: Tensor, states: States, values: Values) -> Tensor:
        """As Chain.sensed."""


def along(chain: Chain, states: States, values: Values) -> Prediction:
    """What the bed measures at rows of a log, (N, 2) SI, with the recordings that they belong to behind them.

    A row whose inputs are not those of its recording (asked what another pressure would do) has the steady change on
    top of what its recording carries.
    """
    assert states.recording is not None
    assert states.place is not None
    per_row = {name: v for name, v in values.items() if v.ndim > len(chain.weights.get(name, ()))}
    if per_row:
        return _row_by_row(chain, states, values, per_row)
    recording, place = states.recording.around(states.place)
    every = measured_along(chain, recording, values)
    if _as_recorded(states, recording, place):
        return Prediction(every.loads[place], every.status[place])
    now, before = _steady(chain, states, values), _steady(chain, recording.states, values)
    return Prediction(now.loads + (every.loads - before.loads)[place], now.status)


def log_jacobian(chain: Chain, states: States, vector: Tensor) -> Tensor:
    """∂loads/∂vector of rows of a log as they were recorded, at a raw vector (p,): (N, 2, p)."""
    assert states.recording is not None
    assert states.place is not None
    recording, place = states.recording.around(states.place)
    size = len(vector)
    unit = torch.eye(size, dtype=vector.dtype, device=vector.device)

    def head(v: Tensor) -> Tensor:
        return torch.stack(_supplied(chain, recording, chain.physical(v)), dim=-1)

    inputs = head(vector)
    # Of all parameters those of the effects before the wall alone move what it balances.
    before = tuple(f"{effect.name}." for effect in (*chain.history["supply"], *chain.history["wall"]))
    moving = [i for i, label in enumerate(chain.labels()) if label.startswith(before)] if before else []
    by_head = _pushed(head, vector, unit, moving) if moving else None
    loads, rates, lost = _steady_rates(chain, recording.states, inputs, vector, by_head)

    def tail(of: Tensor, v: Tensor) -> Tensor:
        return _carried(chain, recording, of, chain.physical(v), lost)

    def column(rate: Tensor, along: Tensor) -> Tensor:
        rate_of: Tensor = torch.func.jvp(tail, (loads, vector), (rate, along))[1]
        return rate_of[place]

    # All at once, so that what no derivative changes is made once; on long logs a few at a time, for the memory.
    some = max(1, TOGETHER // len(recording))
    columns: Tensor = torch.func.vmap(column, in_dims=(2, 0), out_dims=2, chunk_size=some)(rates, unit)
    return columns


@torch.no_grad()
def shifted(chain: Chain, states: States, values: Values) -> Tensor:
    """∂readings/∂ what a whole recording is shifted by, in either quantity of a kinematic state, of rows of a log:
    (N, 2, 2). What is steady would be another value at every row, which a wall or friction carries on."""
    assert states.recording is not None
    assert states.place is not None
    recording, place = states.recording.around(states.place)
    supplied = torch.stack(_supplied(chain, recording, values), dim=-1)
    whole, by, lost = _steady_by_inputs(chain, recording.states, supplied, values)
    by = by[:, :, :2]

    first, second, *others = recording.states.inputs()

    def tail(of: Tensor, shift: Tensor) -> Tensor:
        moved = recording.states.with_inputs([first + shift[0], second + shift[1], *others])
        return _carried(chain, Recording(moved, recording.run, recording.time), of, values, lost)

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
        return Recording(recording.states.with_inputs(x.unbind(-1)), recording.run, recording.time)

    def head(x: Tensor) -> Tensor:
        return torch.stack(_supplied(chain, moved(x), values), dim=-1)

    def tail(of: Tensor, x: Tensor) -> Tensor:
        return _carried(chain, moved(x), of, values, lost)

    loads, by, lost = _steady_by_inputs(chain, recording.states, head(inputs), values)
    places = torch.arange(len(recording), device=inputs.device)

    def column(sample: Tensor) -> Tensor:
        unit = (places == sample).to(inputs.dtype)
        pushed = torch.stack([unit if i == quantity else 0 * unit for i in range(inputs.shape[1])], dim=-1)
        supplied: Tensor = torch.func.jvp(head, (inputs,), (pushed,))[1]
        rate = (by @ supplied[..., None])[..., 0]
        shown: Tensor = torch.func.jvp(tail, (loads, inputs), (rate, pushed))[1]
        return shown

    some = max(1, TOGETHER // len(recording))
    columns: Tensor = torch.func.vmap(column, out_dims=2, chunk_size=some)(samples)
    return columns


def _steady_by_inputs(chain: Chain, states: States, inputs: Tensor, values: Values) -> tuple[Tensor, Tensor, Tensor]:
    """Loads (M, 2) of every sample by itself at inputs (M, i), and ∂loads/∂inputs (M, 2, i): zero where it has none;
    whether it has no equilibrium (M,) bool."""
    loads, rates, lost = [], [], []
    for rows in torch.arange(len(states), device=inputs.device).split(BLOCK):
        with torch.enable_grad():
            at = inputs[rows].detach().requires_grad_()
            found = _before_sensors(chain, states[rows].with_inputs(at.unbind(-1)), values)
            each = [torch.autograd.grad(f.sum(), at, retain_graph=True)[0] for f in found.loads.unbind(-1)]
        loads.append(found.loads.detach())
        lost.append(found.status == Status.NO_EQUILIBRIUM)
        rates.append(torch.stack(each, dim=1).nan_to_num(nan=0.0, posinf=0.0, neginf=0.0))
    return torch.cat(loads), torch.cat(rates), torch.cat(lost)


def _pushed(head: Callable[[Tensor], Tensor], vector: Tensor, unit: Tensor, moving: Sequence[int]) -> Tensor:
    """∂head/∂vector, (M, inputs, p), of a head that only these entries move."""
    each = {i: torch.func.jvp(head, (vector,), (unit[i],))[1] for i in moving}
    still = torch.zeros_like(each[moving[0]])
    return torch.stack([each.get(i, still) for i in range(len(vector))], dim=-1)


def _steady_rates(
    chain: Chain, states: States, inputs: Tensor, vector: Tensor, by_head: Tensor | None
) -> tuple[Tensor, Tensor, Tensor]:
    """Loads (M, 2) of every sample by itself at inputs (M, i), and ∂loads/∂vector (M, 2, p), also by way of these;
    whether it has no equilibrium (M,) bool."""
    loads, rates, lost = [], [], []
    for rows in torch.arange(len(states), device=vector.device).split(BLOCK):
        with torch.enable_grad():
            copies = vector.detach().expand(len(rows), -1).clone().requires_grad_()
            at = inputs[rows].detach().requires_grad_()
            own = states[rows].with_inputs(at.unbind(-1))
            found = _before_sensors(chain, own, chain.physical(copies))
            each = [
                torch.autograd.grad(f.sum(), (copies, at), retain_graph=True, materialize_grads=True)
                for f in found.loads.unbind(-1)
            ]
        by_copies = torch.stack([c for c, _ in each], dim=1)
        if by_head is not None:
            by_inputs = torch.stack([i for _, i in each], dim=1).nan_to_num(nan=0.0)
            by_copies = by_copies + by_inputs @ by_head[rows]
        loads.append(found.loads.detach())
        rates.append(by_copies)
        lost.append(found.status == Status.NO_EQUILIBRIUM)
    return torch.cat(loads), torch.cat(rates), torch.cat(lost)


def measured_along(chain: Chain, recording: Recording[States], values: Values) -> Prediction:
    """What the bed measures at every sample of the recordings."""
    supplied = recording.states.with_inputs(_supplied(chain, recording, values))
    found = _blocks(chain, supplied, values)
    return Prediction(
        _carried(chain, recording, found.loads, values, found.status == Status.NO_EQUILIBRIUM), found.status
    )


def _supplied(chain: Chain, recording: Recording[States], values: Values) -> list[Tensor]:
    """What each actuator's wall balances: the bed's inputs, (M,) each, in the order of States.inputs."""
    states = recording.states
    first, second, *pressures = states.inputs()
    for effect in chain.history["supply"]:
        p = effect.own(values)
        pressures = [effect.carry(pressure[:, None], recording, p)[:, 0] for pressure in pressures]
    for effect in reversed(chain.history["wall"]):
        p = effect.own(values)
        pressures = [effect.undo(pressure[:, None], recording, p)[:, 0] for pressure in pressures]
        if states.bed is DEAD_LOAD:
            first, second = effect.undo(torch.stack([first, second], dim=-1), recording, p).unbind(-1)
    return [first, second, *pressures]


def _carried(chain: Chain, recording: Recording[States], loads: Tensor, values: Values, lost: Tensor) -> Tensor:
    """What the sensors show (M, 2), from the steady loads (M, 2) before them, or the places under a dead load.

    lost: samples without an equilibrium (M,) bool. There what is carried stays as it was, so that samples after them
    are not lost too."""
    lost = lost | ~loads.isfinite().all(-1)
    if all_if_known(~lost):
        return _shown(chain, recording, loads, values)
    stays = (lost & ~recording.first)[:, None].to(loads.dtype)
    shown = _shown(chain, recording, recurred(stays, torch.where(lost[:, None], 0.0, loads)), values)
    return torch.where(lost[:, None], loads, shown)


def _shown(chain: Chain, recording: Recording[States], loads: Tensor, values: Values) -> Tensor:
    if recording.states.bed is not DEAD_LOAD:
        for name in ("wall", "loads"):
            for effect in chain.history[name]:
                loads = effect.carry(loads, recording, effect.own(values))
        loads = chain.sensed(chain.evaded(loads, recording.states, values), recording.states, values)
    for effect in chain.history["readings"]:
        loads = effect.carry(loads, recording, effect.own(values))
    return loads


def _before_sensors(chain: Chain, states: States, values: Values) -> Prediction:
    """The steady chain, without what comes after all that is carried."""
    return chain.steady(states, values) if states.bed is DEAD_LOAD else chain.straight(states, values)


def _blocks(chain: Chain, states: States, values: Values) -> Prediction:
    if len(states) <= BLOCK:
        return _before_sensors(chain, states, values)
    parts = [
        _before_sensors(chain, states[slice(i, i + BLOCK)], values) for i in range(0, len(states), BLOCK)
    ]  # fmt: skip
    return Prediction(torch.cat([p.loads for p in parts]), torch.cat([p.status for p in parts]))


def _steady(chain: Chain, states: States, values: Values) -> Prediction:
    """The chain without its history."""
    parts = [chain.steady(states[slice(i, i + BLOCK)], values) for i in range(0, len(states), BLOCK)]
    return Prediction(torch.cat([p.loads for p in parts]), torch.cat([p.status for p in parts]))


def _as_recorded(states: States, recording: Recording[States], place: Tensor) -> bool:
    """Whether the rows' inputs are those of their recording, to the last bit."""
    pairs = list(zip(states.inputs(), recording.states.inputs(), strict=True))
    if any(own.requires_grad for own, _ in pairs):
        return False
    try:
        return all(torch.equal(own, whole[place]) for own, whole in pairs)
    except RuntimeError:
        # Inside vmap nobody can know.
        return False


def _row_by_row(chain: Chain, states: States, values: Values, per_row: Values) -> Prediction:
    """Rows that each have a copy of the values (N, …): as many passes as there are different copies.

    A row's derivatives by its own copy are those of its reading by values that all of its past shares.
    """
    each = torch.cat([v.detach().reshape(len(states), -1) for v in per_row.values()], dim=1)
    different, member = torch.unique(each, dim=0, return_inverse=True)
    loads = each.new_zeros(len(states), 2)
    status = torch.full((len(states),), int(Status.OK), dtype=torch.uint8, device=each.device)
    for number in range(len(different)):
        rows = (member == number).nonzero()[:, 0]
        own = {name: v[rows] for name, v in per_row.items()}
        shared = values | {name: v[0].detach() for name, v in own.items()}
        found = along(chain, states[rows], {name: v.detach() for name, v in shared.items()})
        grown = found.loads
        for name, v in own.items():
            if v.requires_grad and torch.is_grad_enabled():
                grown = grown + _linear(chain, states[rows], shared, name, v)
        loads, status = loads.index_put((rows,), grown), status.index_put((rows,), found.status)
    return Prediction(loads, status)


def _linear(chain: Chain, states: States, shared: Values, name: str, copies: Tensor) -> Tensor:
    """Zero (n, 2), whose derivative by the rows' copies (n, …) of one value is that of their readings."""
    flat = copies.reshape(len(copies), -1)
    grown = torch.zeros(len(copies), 2, dtype=copies.dtype, device=copies.device)
    for k in range(flat.shape[1]):
        along_k = torch.zeros_like(flat[0])
        along_k[k] = 1.0

        def of(value: Tensor) -> Tensor:
            return along(chain, states, shared | {name: value}).loads

        rate = torch.func.jvp(of, (shared[name],), (along_k.reshape(shared[name].shape),))[1]
        moved = flat[:, k] - flat[:, k].detach()
        grown = grown + rate.detach() * moved[:, None]
    return grown
