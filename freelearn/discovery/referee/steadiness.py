"""Does what a claim leaves, or one of its parameters, change over the session, within recordings, or with work?

A right model has the same parameters at the first row and at the last. What changes slowly and is in no library, a wall
or an amplifier that warms, is nearly a constant for a while: something constant stands for it, and leaves a little of
everything. It shows where each parameter, each reading's gain and each reading's zero is let change with the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.common.formats import in_words, signed
from freelearn.data.beds import behind
from freelearn.data.calm import WIDEST
from freelearn.data.recordings import Recording, recurred
from freelearn.data.states import States
from freelearn.discovery.noise.linear_algebra import VANISHING, norms
from freelearn.discovery.noise.shapes import rows_of_samples, scaled, times
from freelearn.discovery.noise.structure import WhiteBlock, seen
from freelearn.discovery.referee.case import FAIL, PASS, Case, Check

# Chance of calling a model changing that does not, of each kind of change. Right models of logs, whose samples know
# nothing of corners between them, came down to 8e-5 in 32 of the simulated bed; a drift of 15 σ to 1e-9.
CHANCE = 1e-6
# Degree of the polynomials in time.
DEGREE = 3
# Times of the lags by which work is forgotten, the longest of those that a missing history may have.
LATELY = 3
# Share of the rows at either end of a change whose mean is told.
END = 0.1

# What may change of a reading.
READ = GAIN, ZERO = "gain of the {}", "zero of the {}"


@dataclass(frozen=True)
class Change:
    """shapes: functions of the rows, (N, k), in which something may change; along: by what the rows are ordered, (N,).
    low, high: its ends in words; cure: what to measure."""

    name: str
    shapes: Tensor
    along: Tensor
    low: str
    high: str
    cure: str


def steadiness(case: Case) -> list[Check]:
    """One check for each way in which the rows could show a change, the clearest first."""
    checks = [_check(case, change) for change in changes(case.rows.states)]
    return sorted(checks, key=lambda check: check.figure or 0.0)


def changes(states: States) -> list[Change]:
    """Over the session; in a log also within recordings, and after work."""
    session = _over(states, states.clock)
    again = "Measure what was measured first once more at the end: it tells what has changed"
    found = [Change("over the session", _powers(session), session, "at its beginning", "at its end", again)]
    if states.recording is None or states.place is None:
        return found
    recording, place = states.recording.around(states.place)
    within = scaled(states.dwell)
    if len(recording.ends[0].unique()) > 1:
        rest = "Wait at rest before one recording, and before another do not"
        found.append(Change("within recordings", _powers(within), within, "at their beginning", "at their end", rest))
    worked = work(recording)[place]
    if worked.shape[1]:
        pause = "Record the same motion slowly, quickly, and after a pause"
        found.append(Change("with work", worked, worked.sum(1), "after rest", "after much work", pause))
    return found


def _over(states: States, clock: Tensor) -> Tensor:
    """The time of each sample's session, scaled to [−1, 1], (N,)."""
    over = torch.zeros_like(clock)
    for rows in rows_of_samples(states):
        over[rows] = scaled(clock[rows])
    return over


def _powers(x: Tensor) -> Tensor:
    return torch.stack([x**power for power in range(1, DEGREE + 1)], dim=1)


def work(recording: Recording[States]) -> Tensor:
    """How far each quantity imposed has lately gone up and down, forgotten in several times, from none at a recording's
    beginning: (M, k), less their means. Up to some rows before each: a gauge's error in a row is in what a model leaves
    there, and would be in the work that it seems to have done."""
    inputs = torch.stack([scaled(x) for x in recording.states.inputs()], dim=1)
    moved = recording.change(inputs).abs()
    moved = moved[:, moved.amax(0) > 0]
    begins, step = recording.first[:, None], recording.step[:, None]
    columns = []
    for time in times(recording)[-LATELY:]:
        left = torch.where(begins, 0.0, torch.exp(-step / time))
        columns.append(recurred(left, (1 - left) * time / torch.where(begins, 1.0, step) * moved))
    earlier = torch.maximum(torch.arange(len(moved), device=moved.device) - WIDEST - 1, recording.ends[0])
    worked = torch.cat(columns, dim=1)[earlier]
    return worked - worked.mean(0)


def _check(case: Case, change: Change) -> Check:
    fit, whiten, name = case.fit, case.whiten, f"steady {change.name}"
    everywhere = torch.arange(len(case.rows))
    drivers = _drivers(case)

    def white(driver: Tensor) -> Tensor:
        return whiten(driver[:, :, None] * change.shapes[:, None, :]).flatten(0, 1)

    found = seen(fit.residual, fit.jacobian, whiten, ([WhiteBlock(everywhere, white(d))] for d in drivers.values()))
    if found.p_value >= CHANCE:
        says = f"Nothing changes {change.name} that noise would not make look so."
        return Check(name, PASS, found.p_value, CHANCE, says, decides=False)
    labels = [list(drivers)[place] for place in found.seen_by]
    told = (_told(case, change, label, white(drivers[label])) for label in labels)
    says = f"What is missing changes {change.name}: {next(filter(None, told))}. {change.cure}."
    return Check(name, FAIL, found.p_value, CHANCE, says)


def _drivers(case: Case) -> Mapping[str, Tensor]:
    """What may change, by name, and what one unit of it does to the readings, (N, 2): every free raw parameter, and
    each reading's gain and zero."""
    fit = case.fit
    labels, free = fit.model.labels(), fit.model.free.tolist()
    own = [i for i, label in enumerate(labels) if free[i] and label in fit.model.declared]
    named = {labels[i]: fit.raw_jacobian[:, :, i] for i in own}
    for channel, quantity in enumerate(case.rows.states.bed.readings):
        if bool(case.present[:, channel].any()):
            only = torch.zeros_like(fit.shown)
            only[:, channel] = 1.0
            named |= {GAIN.format(quantity.name): only * fit.shown, ZERO.format(quantity.name): only}
    return named


def _told(case: Case, change: Change, label: str, white: Tensor) -> str:
    """What changes from one end to the other, in words; empty where no parameter may be what it would have to be.

    white: the whitened shapes (2N, k), each times what one unit of it does."""
    fit, declared = case.fit, case.fit.model.declared
    columns = torch.cat([fit.jacobian.flatten(0, 1), white], dim=1)
    length = norms(columns).clamp_min(VANISHING)
    step = -(torch.linalg.pinv(columns / length, rtol=1e-8) @ fit.residual.reshape(-1)) / length
    moved = change.shapes @ step[len(fit.vector) :]
    moved = moved - moved.mean()
    order = change.along.argsort()
    ends = max(int(END * len(order)), 1)
    each = [float(moved[rows].mean()) for rows in (order[:ends], order[-ends:])]
    if label in declared:
        place, p = fit.model.labels().index(label), declared[label]
        values = [float(p.to_physical(fit.vector[place] + off)) for off in each]
        if not all(p.lower <= value <= p.upper for value in values):
            return ""
        words = [in_words(value, 4) + behind(p.unit) for value in values]
    else:
        kind, quantity = next((k, q) for k in READ for q in case.rows.states.bed.readings if label == k.format(q.name))
        words = [f"{1 + off:.3f}" if kind is GAIN else signed(off / quantity.factor) + quantity.suffix for off in each]
    name = label if label in declared else f"the {label}"
    return f"{name} is {words[0]} {change.low} and {words[1]} {change.high}"
