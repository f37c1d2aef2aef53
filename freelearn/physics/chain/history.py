"""The chain along a log: what effects of the history carry from sample to sample of whole recordings.

pressure (and hung loads) → `supply`, `wall` undone → the chain of every sample by itself → `wall`, `loads` carried →
sensors → `readings` carried. Only the steady middle is costly, and it knows no time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

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
# What effects act on that carry loads or readings on.
CARRIED = ("wall", "loads", "readings")


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


def measured_along(chain: Chain, recording: Recording[States], values: Values) -> Prediction:
    """What the bed measures at every sample of the recordings."""
    given = supplied(chain, recording, values)
    found = _blocks(chain, recording.states.with_inputs(given), values)
    recording = flickering(chain, recording, given, found.loads, values)
    lost = found.status == Status.NO_EQUILIBRIUM
    return Prediction(carried(chain, recording, found.loads, values, lost), found.status)


def supplied(chain: Chain, recording: Recording[States], values: Values) -> list[Tensor]:
    """What each actuator's wall balances: the bed's inputs, (M,) each, in the order of States.inputs."""
    states = recording.states
    first, second, *pressures = states.inputs()
    for effect in chain.history["supply"]:
        p = effect.own(values)
        pressures = [_calmly(effect.carry, pressure[:, None], recording, p)[:, 0] for pressure in pressures]
    for effect in reversed(chain.history["wall"]):
        p = effect.own(values)
        pressures = [_calmly(effect.undo, pressure[:, None], recording, p)[:, 0] for pressure in pressures]
        if states.bed is DEAD_LOAD:
            first, second = _calmly(effect.undo, torch.stack([first, second], dim=-1), recording, p).unbind(-1)
    return [first, second, *pressures]


def _calmly(effect: Callable[..., Tensor], signal: Tensor, recording: Recording[States], p: Any) -> Tensor:
    """What an effect makes of a signal (M, c), on top of what a gauge flickers in it, of which it is not the cause: no
    effect may fit better by smoothing noise."""
    calm = recording.calmed(signal)
    return _around(effect, calm, None if calm is signal else signal - calm, recording, p)


def _around(
    effect: Callable[..., Tensor], quiet: Tensor, noise: Tensor | None, recording: Recording[States], p: Any
) -> Tensor:
    """What an effect makes of a quiet signal (M, c), and the noise that passes by it."""
    found: Tensor = effect(quiet, recording, p)
    return found if noise is None else found + noise


def settled_flicker(chain: Chain, states: States, values: Values) -> States:
    """Rows of a measured log, (N,), in whose recordings stands what their gauges' noise makes of the loads, as the
    model has it at these values; other rows as they are. A fit needs it to stay while its values move."""
    if states.recording is None or not _straight(states.recording):
        return states
    with torch.no_grad():
        given = supplied(chain, states.recording, values)
        loads = _blocks(chain, states.recording.states.with_inputs(given), values).loads
        flicker = _flicker(chain, states.recording, given, loads, values)
    return states.replace(recording=replace(states.recording, flicker=flicker))


def flickering(
    chain: Chain, recording: Recording[States], given: Sequence[Tensor], loads: Tensor, values: Values
) -> Recording[States]:
    """The recording with what its gauges' noise makes of the steady loads (M, 2) at the inputs that are given, (M,)
    each, where it is a measured one and does not know that yet. Of that noise nothing is carried on: no effect may fit
    better by smoothing it."""
    carries = any(chain.history[name] for name in CARRIED)
    if not carries or recording.flicker is not None or not _straight(recording):
        return recording
    with torch.no_grad():
        return replace(recording, flicker=_flicker(chain, recording, given, loads, values))


def _straight(recording: Recording[States]) -> bool:
    """Whether what was imposed went along lines somewhere, by which its noise is told."""
    return recording.calm is not None and recording.calm.straight


def _flicker(
    chain: Chain, recording: Recording[States], given: Sequence[Tensor], loads: Tensor, values: Values
) -> Tensor:
    """By how much the steady loads (M, 2) are off those of what was imposed without its noise."""
    inputs = torch.stack(recording.states.inputs(), dim=-1)
    noise = inputs - recording.calmed(inputs)
    rows = noise.any(dim=-1).nonzero()[:, 0]
    if not len(rows):
        return torch.zeros_like(loads)
    fixed = {name: value.detach() for name, value in values.items()}
    quiet = torch.stack([x.detach() for x in given], dim=-1) - noise
    # Whole recordings know where a search for their equilibria begins.
    states = recording.states if 2 * len(rows) > len(noise) else recording.states[rows]
    calm = quiet if states is recording.states else quiet[rows]
    found = _blocks(chain, states.with_inputs(calm.unbind(-1)), fixed).loads
    if states is not recording.states:
        found = loads.detach().index_copy(0, rows, found)
    return (loads.detach() - found).nan_to_num(nan=0.0, posinf=0.0, neginf=0.0)


def carried(chain: Chain, recording: Recording[States], loads: Tensor, values: Values, lost: Tensor) -> Tensor:
    """What the sensors show (M, 2), from the steady loads (M, 2) before them, or the places under a dead load.

    lost: samples without an equilibrium (M,) bool. There what is carried stays as it was, so that samples after them
    are not lost too."""
    lost = without(loads, lost)
    if all_if_known(~lost):
        return _shown(chain, recording, loads, values)
    shown = _shown(chain, recording, bridged(recording, loads, lost), values)
    return torch.where(lost[:, None], loads, shown)


def without(loads: Tensor, lost: Tensor) -> Tensor:
    """Samples whose steady loads (M, 2) are not carried on: those without an equilibrium, or not finite, (M,) bool."""
    return lost | ~loads.isfinite().all(-1)


def bridged(recording: Recording[States], loads: Tensor, lost: Tensor) -> Tensor:
    """Loads (M, 2) that stay as they were where they are lost (M,) bool."""
    stays = (lost & ~recording.first)[:, None].to(loads.dtype)
    return recurred(stays, torch.where(lost[:, None], 0.0, loads))


class Stage(NamedTuple):
    """One step of the way from the steady loads (M, 2) to what is shown. effect: whose it is; None: the sensors'."""

    effect: HistoryEffect[Any] | None
    of: Callable[[Tensor, Values], Tensor]


def stages(chain: Chain, recording: Recording[States]) -> list[Stage]:
    """From the steady loads before the sensors, or the places under a dead load, to what is shown, in order."""

    def carry(effect: HistoryEffect[Any]) -> Stage:
        def of(loads: Tensor, values: Values) -> Tensor:
            noise = recording.flicker
            quiet = loads if noise is None else loads - noise
            return _around(effect.carry, quiet, noise, recording, effect.own(values))

        return Stage(effect, of)

    def sense(loads: Tensor, values: Values) -> Tensor:
        return chain.sensed(chain.evaded(loads, recording.states, values), recording.states, values)

    readings = [carry(effect) for effect in chain.history["readings"]]
    if recording.states.bed is DEAD_LOAD:
        return readings
    before = [carry(effect) for name in ("wall", "loads") for effect in chain.history[name]]
    return [*before, Stage(None, sense), *readings]


def _shown(chain: Chain, recording: Recording[States], loads: Tensor, values: Values) -> Tensor:
    for stage in stages(chain, recording):
        loads = stage.of(loads, values)
    return loads


def before_sensors(chain: Chain, states: States, values: Values) -> Prediction:
    """The steady chain, without what comes after all that is carried."""
    return chain.steady(states, values) if states.bed is DEAD_LOAD else chain.straight(states, values)


def _blocks(chain: Chain, states: States, values: Values) -> Prediction:
    if len(states) <= BLOCK:
        return before_sensors(chain, states, values)
    parts = [
        before_sensors(chain, states[slice(i, i + BLOCK)], values) for i in range(0, len(states), BLOCK)
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
