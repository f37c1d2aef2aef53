"""One sample of a recording in place of all: what effects of the history are followed by from call to call."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.recordings import STEPPING, Matrix, Steps
from freelearn.data.states import States
from freelearn.export.arithmetic.function import Port
from freelearn.physics.chain.lags import SHORTEST

# More samples than these no dead time keeps.
MOST_KEPT = 500
# Of whom it is what goes on where a sample has no equilibrium; what a lag's recurrence is.
LAST, AHEAD = "last", "how far its input is ahead of what follows it"
BEGUN = Port("begun", "1", "0 before the first sample, 1 after it")


class OneStep:
    """The present sample of a recording, with what the last one left: a Recording of one row, and recordings.Step.

    states: its one row. dt: time since the last sample (1,) s. before: the state, (1,) each, all zero before the first
    sample; None makes out how long it is. usual: seconds from sample to sample as they mostly are, by which a dead time
    knows how many it has to keep.

    Effects ask for their states in the same order in every call. ports says what they are, after what they become.
    """

    # What an export is told has no noise.
    calm, flicker = None, None

    def __init__(self, dt: Tensor, before: Sequence[Tensor] | None, usual: float) -> None:
        self.states: States
        self.before, self.usual = before, usual
        self.ports: list[Port] = []
        self.after: list[Tensor] = []
        # Of whom a state is, and the units of its channels.
        self.owner, self.units = "begin", tuple[str, ...](("1",))
        self._changes: list[tuple[Tensor, Tensor]] = []
        # Whether all that is asked of earlier samples is kept, (1,) bool.
        self.covered = torch.ones_like(dt, dtype=torch.bool)
        begun = self.kept(BEGUN.about, dt)
        self.ports[0] = BEGUN
        self.first = begun() == 0
        begun(torch.ones_like(dt))
        self.step = torch.where(self.first, 0.0, dt.clamp_min(SHORTEST))

    def __getattr__(self, name: str) -> Any:
        raise UserError(
            f"Effect {self.owner!r} follows a recording in a way of its own (recording.{name}), which no export can: "
            "write it with lag, rung, held, delayed or followed, or use predict."
        )

    def calmed(self, signal: Tensor) -> Tensor:
        """The signal (1, c)."""
        return signal

    @contextmanager
    def owned(self, owner: str, units: Sequence[str]) -> Iterator[None]:
        """Inside of it, states are of an effect of this name (or LAST), and of channels in these units."""
        before = self.owner, self.units
        self.owner, self.units = owner, tuple(units)
        token = STEPPING.set(self)
        try:
            yield
        finally:
            STEPPING.reset(token)
            self.owner, self.units = before

    def kept(self, about: str, like: Tensor, per: str = "") -> Callable[..., Tensor]:
        """A state like a tensor (1, …): called without an argument it gives what the last sample left, with one it
        takes what this sample leaves. per: what its unit has more than its channel's."""
        start, count = len(self.ports), like.numel()
        shape = tuple(like.shape)
        before = sum(p.about.startswith(f"{self.owner}: ") for p in self.ports)
        for i in range(count):
            place = i * len(self.units) // count
            which = "" if len(self.units) == 1 else f", channel {place + 1}"
            unit = self.units[place] + per
            self.ports.append(Port(f"{self.owner}_{before + i + 1}", unit, f"{self.owner}: {about}{which}"))
            self.after.append(torch.zeros(1, dtype=torch.float64))

        def state(value: Tensor | None = None) -> Tensor:
            if value is not None:
                self.after[start : start + count] = value.expand(shape).reshape(count, 1).unbind(0)
                return value
            if self.before is None:
                return torch.zeros(shape, dtype=torch.float64)
            return torch.cat(list(self.before[start : start + count])).reshape(shape)

        return state

    def change(self, signal: Tensor) -> Tensor:
        """As Recording.change."""
        for known, change in self._changes:
            if known is signal:
                return change
        last = self.kept("its input at the last sample", signal)
        change = torch.where(self.first.reshape(-1, *[1] * (signal.ndim - 1)), 0.0, signal - last())
        last(signal)
        self._changes.append((signal, change))
        return change

    def recurred(self, factor: Tensor, added: Tensor) -> Tensor:
        """As recordings.recurred."""
        factor, added = torch.broadcast_tensors(factor, added)
        about = "what was there at the last sample with an equilibrium" if self.owner == LAST else AHEAD
        state = self.kept(about, added)
        return state(factor * state() + added)

    def stopped(self, signal: Tensor, low: Tensor, high: Tensor) -> Tensor:
        """As recordings.stopped."""
        change = self.change(signal)
        change, low, high = torch.broadcast_tensors(change, low, high)
        state = self.kept("what an element that sticks holds back", change)
        return state(torch.minimum(torch.maximum(state() + change, low), high))

    def turned(self, matrix: Matrix, added: tuple[Tensor, Tensor]) -> Steps:
        """As recordings.turned."""
        first, second = torch.broadcast_tensors(*added)
        one = self.kept("how far it is from where it would rest", first)
        two = self.kept("how fast it moves", second, "/s")
        (a, b), (c, d) = matrix
        x, y = one(), two()
        return one(a * x + b * y + first), two(c * x + d * y + second)

    def followed(self, step: Callable[..., Tensor], known: Sequence[Tensor], anew: Tensor, begins: Tensor) -> Tensor:
        """As recordings.followed."""
        state = self.kept("what it has come to", begins)
        return state(torch.where(anew, begins, step(state(), *known)))

    def delayed(self, signal: Tensor, delay: Tensor) -> Tensor:
        """As lags.delayed: over the samples that are kept, the oldest of which stays beyond them."""
        late = float(delay)
        if late < 0:
            raise UserError(
                f"Effect {self.owner!r} has a delay of {late:.3g} s: at a sample it goes by the pressure of a later "
                "one, which no export can know; use predict."
            )
        # Twice as many as there usually are within the delay.
        count = math.ceil(2 * late / self.usual) + 2
        if count > MOST_KEPT:
            raise UserError(
                f"Effect {self.owner!r} has a delay of {late:.3g} s, for which some {count} samples would have to be "
                f"kept, and an export keeps {MOST_KEPT}: thin the log (rate_hz) and fit again, or use predict."
            )
        values = self.kept("its input at an earlier sample, the latest first", signal.expand(count, -1))
        with self.owned(self.owner, ("s",)):
            ages = self.kept("time from that sample to the last one", torch.zeros(count, dtype=torch.float64))
        first = self.first[:, None]
        old = torch.where(self.first, 0.0, ages() + self.step)
        held = torch.where(first, signal.expand(count, -1), values())
        times, levels = torch.cat([torch.zeros_like(self.step), old]), torch.cat([signal, held])
        ages(times[:-1])
        values(levels[:-1])
        # Straight lines from sample to sample: of each the share that lies within the delay.
        span, fall = times[1:] - times[:-1], levels[:-1] - levels[1:]
        share = ((late - times[:-1]) / torch.where(span > 0, span, 1.0)).clamp(0.0, 1.0)
        # Not all of the delay lies within what is kept, unless that goes back to the first sample.
        self.covered = self.covered & ((times[-1:] >= late) | (span[-1:] == 0))
        return signal - (share[:, None] * fall).sum(0, keepdim=True)
