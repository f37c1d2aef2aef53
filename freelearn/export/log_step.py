"""A fitted log's actuator from one sample to the next: its answer now, and the state that it hands on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import DEAD_LOAD
from freelearn.data.states import noise_band
from freelearn.export.actuator import HISTORY, WORST, Actuator
from freelearn.export.arithmetic.function import Function, Port, pruned
from freelearn.export.arithmetic.trace import traced
from freelearn.export.forward import STATUS
from freelearn.export.one_step import LAST, OneStep
from freelearn.physics.chain.chain import Chain
from freelearn.physics.chain.history import measured_along
from freelearn.physics.chain.ports import HistoryEffect

STEP = "step"
DT = Port("dt", "s", "time since the last sample, more than zero; at the first sample it does not matter")
# Names and units of what is remembered of a whole recording, and may be given at its begin.
GIVEN = ("clock", "moved_length", "moved_twist", WORST)


@dataclass(frozen=True)
class _Followed:
    """An effect whose states are known as its own."""

    effect: HistoryEffect[Any]
    units: dict[int, tuple[str, ...]]

    @property
    def name(self) -> str:
        return self.effect.name

    def own(self, values: Any) -> Any:
        return self.effect.own(values)

    def carry(self, signal: Tensor, recording: Any, p: Any) -> Tensor:
        with recording.owned(self.name, self.units[signal.shape[1]]):
            return self.effect.carry(signal, recording, p)

    def undo(self, signal: Tensor, recording: Any, p: Any) -> Tensor:
        # Under a dead load what is undone of two channels are loads.
        with recording.owned(self.name, {1: ("Pa",), 2: ("N", "N*m")}[signal.shape[1]]):
            return self.effect.undo(signal, recording, p)


class _FollowedChain:
    """A chain with such effects."""

    def __init__(self, chain: Chain, units: dict[int, tuple[str, ...]]) -> None:
        self._chain = chain
        self.history = {name: [_Followed(e, units) for e in some] for name, some in chain.history.items()}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._chain, name)


def stepped(actuator: Actuator) -> Function:
    """What is imposed, dt and the state → the answer, status, inside and the next state. Raises UserError for an effect
    that cannot be followed from sample to sample."""
    count, memory = len(actuator.imposed), actuator.memory
    answered, values, shown = actuator.answered, actuator.system.values, actuator.shown
    second = tuple(p.unit for p in answered) if actuator.bed is DEAD_LOAD else ("N", "N*m")
    chain: Any = _FollowedChain(actuator.fitted.model, {1: ("Pa",), 2: second})
    bands, usual = _bands(actuator), usual_step(actuator)
    held = actuator.held
    _ = actuator.edges, actuator.rest, held and (held.edges, held.rest)

    def sample(imposed: Sequence[Tensor], dt: Tensor, before: Sequence[Tensor] | None) -> tuple[OneStep, list[Tensor]]:
        step = OneStep(dt, before, usual)
        remembered = _remembered(step, memory, imposed[2:], bands)
        system, x, worst = actuator.place((*imposed, *(remembered[p.name] for p in memory)))
        for port, now in zip(memory[-len(worst) :], worst, strict=True):
            # What the state itself is at stands behind it.
            step.after[[p.name for p in step.ports].index(port.name)] = now
        step.states = system.states.with_inputs(x.unbind(-1))
        with step.owned(LAST, second):
            loads, status = measured_along(chain, step, values)  # type: ignore[arg-type]
        inside = actuator.reaches(x, loads) & step.covered
        return step, [loads[:, shown], status.to(torch.float64), inside.to(torch.float64)]

    tried: list[OneStep] = []

    def first(*inputs: Tensor) -> Sequence[Tensor]:
        step, found = sample(inputs[:count], inputs[count], None)
        tried.append(step)
        return found

    # Once to see what states there are.
    what = f"Model {actuator.fitted.title}"
    traced(first, count + 1, what)
    made = tried[0]
    for effect in (e for some in actuator.fitted.model.history.values() for e in some):
        if not any(p.about.startswith(f"{effect.name}: ") for p in made.ports):
            raise UserError(
                f"Effect {effect.name!r} keeps its state in a way of its own, which no export can: write it with lag, "
                "rung, held, delayed or followed, or use predict."
            )

    def known(*inputs: Tensor) -> Sequence[Tensor]:
        step, found = sample(inputs[:count], inputs[count], inputs[count + 1 :])
        return [*found, *step.after]

    ports = (*actuator.imposed, DT, *made.ports)
    graph, nodes = traced(known, len(ports), what)
    flat, after = [i for some in nodes[:3] for i in some], [some[0] for some in nodes[3:]]
    kept = _kept(graph, flat, after, count + 1)
    out = [
        *answered,
        Port("status", "1", f"what the model says of the sample: {STATUS}"),
        Port(
            "inside",
            "1",
            "1 where the data that the model was fitted on reach (and samples are not so close together that a dead "
            "time goes back beyond those that are kept), 0 elsewhere: nothing is promised there",
        ),
        *(Port(f"{made.ports[i].name}_next", made.ports[i].unit, made.ports[i].about) for i in kept),
    ]
    flat += [after[i] for i in kept]
    inputs = pruned(graph, [flat], ports, count + 1)
    about = "the answer at a sample of a log, and the state for the next one"
    return Function(STEP, about, inputs, tuple(out), graph, tuple(flat), len(kept))


def _kept(graph: Any, outputs: list[int], after: list[int], imposed: int) -> list[int]:
    """Places of the states that the outputs depend on, by way of other states too."""
    kept, new = set[int](), {i - imposed for i in graph.inputs(outputs) if i >= imposed}
    while new:
        kept |= new
        new = {i - imposed for i in graph.inputs([after[j] for j in kept]) if i >= imposed} - kept
    return sorted(kept)


def _remembered(
    step: OneStep, memory: Sequence[Port], pressures: Sequence[Tensor], bands: Sequence[float]
) -> dict[str, Tensor]:
    """What a row of a log remembers besides its effects' states (data.states), by name."""
    found = {}
    with step.owned("direction", ("Pa",)):
        for i, (pressure, band) in enumerate(zip(pressures, bands, strict=True)):
            play = torch.where(step.first, 0.0, torch.full_like(pressure, band))
            ahead = step.stopped(pressure, -play, play)
            step.units = ("1",)
            last = step.kept("in which the pressure last moved by more than its noise", pressure)
            step.units = ("Pa",)
            now = torch.where(step.first, 0.0, torch.where(ahead.abs() >= play, torch.sign(ahead), last()))
            found[memory[i].name] = last(now)
    for port in (*HISTORY, *(p for p in memory if p.name.startswith(WORST))):
        # Under their own names, for whoever gives them at the begin of a recording.
        with step.owned(port.name, (port.unit,)):
            state = step.kept(port.about, step.step)
        step.ports[-1] = Port(port.name, port.unit, _begun(port))
        now = state() + step.step if port.name in ("clock", "dwell") else state()
        found[port.name] = state(now)
    return found


def _begun(port: Port) -> str:
    given = any(port.name.startswith(name) for name in GIVEN)
    return f"{port.about}; before the first sample it may be given" if given else port.about


def _bands(actuator: Actuator) -> list[float]:
    """Play of each pressure's direction, Pa, as the run's table has it."""
    recording = actuator.rows.recording
    assert recording is not None
    states = recording.states
    return [noise_band(s.pressure.numpy()) for s in states.members or (states,)]


def usual_step(actuator: Actuator) -> float:
    """Median time from sample to sample of the run's log, s."""
    recording = actuator.rows.recording
    assert recording is not None
    return float(np.median(recording.step[~recording.first].numpy()))
