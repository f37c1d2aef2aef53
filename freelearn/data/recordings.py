"""Recordings: the rows of a log in the order of time, and recurrences along them without a loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.common.vmapped import all_if_known
from freelearn.data.calm import Calm
from freelearn.data.linear_recurrence import linear_recurrence
from freelearn.data.logs import TIME, run_numbers
from freelearn.data.stops import Spread, stops

# Recurrences along a log without a loop over its samples: their steps compose. Those that are lines or clamps go block
# beside block (see blocks); of pairs a tree of depth log₂ N computes all N states (Blelloch, Prefix sums and their
# applications, CMU-CS-90-190, 1990), of torch operations alone, so that every derivative follows.

Steps = tuple[Tensor, ...]
Matrix = tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor]]


class Step(Protocol):
    """One sample after the other in place of all at once: each recurrence of it begins from what the last sample left.

    Its methods stand for the functions of their names."""

    def recurred(self, factor: Tensor, added: Tensor) -> Tensor:
        """As below."""

    def stopped(self, signal: Tensor, low: Tensor, high: Tensor) -> Tensor:
        """As below."""

    def turned(self, matrix: Matrix, added: tuple[Tensor, Tensor]) -> Steps:
        """As below."""

    def followed(self, step: Callable[..., Tensor], known: Sequence[Tensor], anew: Tensor, begins: Tensor) -> Tensor:
        """As below."""

    def delayed(self, signal: Tensor, delay: Tensor) -> Tensor:
        """As lags.delayed."""


# What recurrences are done by at present; None: all samples at once.
STEPPING: ContextVar[Step | None] = ContextVar("STEPPING", default=None)
# One element alone.
ONE = Spread((1.0,), (1.0,))
# Rounds of a nonlinear recurrence where nobody can know whether it has settled, and the share by which it may move yet.
ROUNDS, CLOSE = 30, 1e-12


def scanned(compose: Callable[[Steps, Steps], Steps], steps: Steps) -> Steps:
    """The composition of the first 1, 2, …, N steps: each tensor (N, …) → (N, …). compose(earlier, later)."""
    count = steps[0].shape[0]
    if count < 2:
        return steps
    pairs = compose(tuple(s[0 : count - 1 : 2] for s in steps), tuple(s[1::2] for s in steps))
    odd = scanned(compose, pairs)
    if count == 2:
        return tuple(torch.cat([s[:1], o]) for s, o in zip(steps, odd, strict=True))
    before = odd if count % 2 else tuple(o[:-1] for o in odd)
    even = compose(before, tuple(s[2::2] for s in steps))
    return tuple(_woven(torch.cat([s[:1], e]), o) for s, e, o in zip(steps, even, odd, strict=True))


def _woven(even: Tensor, odd: Tensor) -> Tensor:
    """Even and odd places, one after the other."""
    count = odd.shape[0]
    woven = torch.stack([even[:count], odd], dim=1).flatten(0, 1)
    return woven if even.shape[0] == count else torch.cat([woven, even[count:]])


def recurred(factor: Tensor, added: Tensor) -> Tensor:
    """y with yₙ = aₙ yₙ₋₁ + bₙ, y before the first sample 0. a: (N, …), b: as a. a = 0 begins anew.

    >>> recurred(torch.tensor([0.0, 0.5, 0.5]), torch.tensor([8.0, 0.0, 1.0])).tolist()
    [8.0, 4.0, 3.0]
    """
    if (one := STEPPING.get()) is not None:
        return one.recurred(factor, added)
    return linear_recurrence(factor, added)


def stopped(signal: Tensor, low: Tensor, high: Tensor) -> Tensor:
    """z with zₙ = min(max(zₙ₋₁ + xₙ − xₙ₋₁, lowₙ), highₙ): the stop operator of a signal x, low ≤ high, (N, …) each.

    low = high begins anew, and does so at the first sample. A clamp after a shift after such a pair is one again.

    >>> z = stopped(torch.tensor([7.0, 10.0, 9.0, 4.0]), *torch.tensor([[0.0, -2.0, -2.0, -2.0], [0.0, 2.0, 2.0, 2.0]]))
    >>> z.tolist()
    [0.0, 2.0, 1.0, -2.0]
    """
    if (one := STEPPING.get()) is not None:
        return one.stopped(signal, low, high)
    signal, low, high = torch.broadcast_tensors(signal, low, high)
    return stops(signal, low, high, ONE, None)


def turned(matrix: Matrix, added: tuple[Tensor, Tensor]) -> Steps:
    """Pairs z with zₙ = Aₙ zₙ₋₁ + bₙ, z before the first sample 0: A 2 × 2 and b, each entry (N, …). A = 0 begins anew.

    >>> still, quarter = torch.tensor([0.0, 0.0]), torch.tensor([0.0, 1.0])
    >>> one, two = turned(((still, -quarter), (quarter, still)), (torch.tensor([2.0, 0.0]), still))
    >>> one.int().tolist(), two.int().tolist()
    ([2, 0], [0, 2])
    """
    if (one := STEPPING.get()) is not None:
        return one.turned(matrix, added)

    def compose(one: Steps, two: Steps) -> Steps:
        a, b, c, d, x, y = one
        e, f, g, h, u, v = two
        return (
            e * a + f * c, e * b + f * d, g * a + h * c, g * b + h * d, e * x + f * y + u, g * x + h * y + v,
        )  # fmt: skip

    steps = torch.broadcast_tensors(*matrix[0], *matrix[1], *added)
    return scanned(compose, tuple(steps))[4:]


def followed(
    step: Callable[..., Tensor], known: Sequence[Tensor], anew: Tensor, begins: Tensor, guess: Tensor
) -> Tensor:
    """x with xₙ = fₙ(xₙ₋₁), whatever f: Newton's method on all samples at once (Lim et al. 2024), with first
    derivatives by what is known.

    step: x before every sample, and what is known (broadcast to N rows, or numbers) → f, each (N, …), row by row. anew:
    (N, …) bool, samples whose x is begins (N, …) and not f's. guess: (N, …), from where the search begins. Each round
    solves the linear recurrence of the slopes; for a contraction few are needed from a guess at which it forgets
    nothing at once, and never more than N. The derivatives obey the last round's recurrence.
    """
    if (one := STEPPING.get()) is not None:
        return one.followed(step, known, anew, begins)
    fixed, first = [value.detach() for value in known], begins.detach()
    found = guess.detach()
    ones = torch.ones_like(found)
    for turn in range(max(len(found), ROUNDS)):
        before = torch.cat([found[:1], found[:-1]])
        value, slope = torch.func.jvp(lambda x: step(x, *fixed), (before,), (ones,))  # type: ignore[misc]
        slope = torch.where(anew, 0.0, slope)
        last, found = found, recurred(slope, torch.where(anew, first, value - slope * before))
        # What is no number stays none.
        settled = all_if_known(~((found - last).abs() > CLOSE * (1 + found.abs())))
        if settled or (settled is None and turn >= ROUNDS):
            break
    before = torch.cat([found[:1], found[:-1]])
    return recurred(slope, torch.where(anew, begins, step(before, *known) - slope * before))


# Recordings: the rows of a log in the order of time, which what has a memory follows from sample to sample.


class Samples(Protocol):
    """What is asked of states.States."""

    def __len__(self) -> int: ...

    def __getitem__(self, rows: Tensor) -> Any: ...

    def to(self, device: torch.device | str) -> Any:
        """The same on a device."""


S = TypeVar("S", bound=Samples)


@dataclass(frozen=True)
class Recording(Generic[S]):
    """All M samples of some recordings, one recording after the other, each in the order of time.

    states: of the M rows as the table has them. run: number of the recording (M,), int64. time: (M,) s. turns: samples
    that are no row of the table, but where something imposed turned between two (M,) bool; None: no sample is. calm:
    of a log that was measured, what its samples were without noise; None: what is imposed is known. flicker: what that
    noise makes of the loads, where a model has told, (M, 2).
    """

    states: S
    run: Tensor
    time: Tensor
    turns: Tensor | None = None
    calm: Calm | None = None
    flicker: Tensor | None = None

    @classmethod
    def from_table(cls, table: pd.DataFrame, states: S) -> Recording[S]:
        """Of a log; states: of its rows."""
        time = torch.as_tensor(np.array(table[TIME], dtype=np.float64))
        return cls(states, torch.as_tensor(run_numbers(table)), time)

    def __len__(self) -> int:
        return len(self.states)

    def to(self, device: torch.device | str) -> Recording[S]:
        """The same on a device."""
        turns = None if self.turns is None else self.turns.to(device)
        flicker = None if self.flicker is None else self.flicker.to(device)
        return Recording(self.states.to(device), self.run.to(device), self.time.to(device), turns, self.calm, flicker)

    def __getitem__(self, rows: Tensor) -> Recording[S]:
        """The samples of these numbers, in the order of time."""
        turns = None if self.turns is None else self.turns[rows]
        calm = None if self.calm is None else self.calm[rows]
        flicker = None if self.flicker is None else self.flicker[rows]
        return Recording(self.states[rows], self.run[rows], self.time[rows], turns, calm, flicker)

    def with_states(self, states: S) -> Recording[S]:
        """The same samples in other states."""
        return replace(self, states=states)

    def calmed(self, signal: Tensor) -> Tensor:
        """A signal (M, c) as it was without the noise of what was imposed, as far as the samples tell."""
        return signal if self.calm is None else self.calm.of(signal)

    def around(self, place: Tensor) -> tuple[Recording[S], Tensor]:
        """The whole recordings that the rows (n,) int64 belong to, and the rows' places in these."""
        runs = self.run[place].unique()
        inside = torch.isin(self.run, runs)
        if bool(inside.all()):
            return self, place
        rows = inside.nonzero()[:, 0]
        return self[rows], torch.searchsorted(rows, place)

    @cached_property
    def first(self) -> Tensor:
        """Whether a row is its recording's first, (M,) bool."""
        first = torch.ones_like(self.run, dtype=torch.bool)
        first[1:] = self.run[1:] != self.run[:-1]
        return first

    @cached_property
    def step(self) -> Tensor:
        """Time since the recording's last sample, (M,) s: zero at its first."""
        step = torch.zeros_like(self.time)
        step[1:] = self.time.diff()
        return torch.where(self.first, 0.0, step)

    def change(self, signal: Tensor) -> Tensor:
        """By how much a signal (M, …) has changed since the recording's last sample: zero at its first."""
        before = torch.cat([signal[:1], signal[:-1]])
        first = self.first.reshape(-1, *[1] * (signal.ndim - 1))
        return torch.where(first, 0.0, signal - before)

    @cached_property
    def ends(self) -> tuple[Tensor, Tensor]:
        """Places of the first and of the last sample of each row's recording, (M,) int64 each."""
        begun = torch.nonzero(self.first)[:, 0]
        number = self.first.long().cumsum(0) - 1
        ended = torch.cat([begun[1:], begun.new_tensor([len(self)])]) - 1
        return begun[number], ended[number]

    def strung(self, apart: float) -> Tensor:
        """One clock for all recordings, (M,) s: each begins so much later than the one before it ended."""
        step = torch.where(self.first, apart, self.step)
        return step.cumsum(0)
