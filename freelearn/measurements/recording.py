"""Recordings: the rows of a log in the order of time, which what has a memory follows from sample to sample."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.measurements.log import TIME, run_numbers


class Samples(Protocol):
    """What is asked of measurements.states.States."""

    def __len__(self) -> int: ...

    def __getitem__(self, rows: Tensor) -> Any: ...

    def to(self, device: torch.device | str) -> Any:
        """The same on a device."""


S = TypeVar("S", bound=Samples)


@dataclass(frozen=True)
class Recording(Generic[S]):
    """All M samples of some recordings, one recording after the other, each in the order of time.

    states: of the M rows as the table has them. run: number of the recording (M,), int64. time: (M,) s.
    """

    states: S
    run: Tensor
    time: Tensor

    @classmethod
    def from_table(cls, table: pd.DataFrame, states: S) -> Recording[S]:
        """Of a log; states: of its rows."""
        time = torch.as_tensor(np.array(table[TIME], dtype=np.float64))
        return cls(states, torch.as_tensor(run_numbers(table)), time)

    def __len__(self) -> int:
        return len(self.states)

    def to(self, device: torch.device | str) -> Recording[S]:
        """The same on a device."""
        return Recording(self.states.to(device), self.run.to(device), self.time.to(device))

    def around(self, place: Tensor) -> tuple[Recording[S], Tensor]:
        """The whole recordings that the rows (n,) int64 belong to, and the rows' places in these."""
        runs = self.run[place].unique()
        inside = torch.isin(self.run, runs)
        if bool(inside.all()):
            return self, place
        rows = inside.nonzero()[:, 0]
        return Recording(self.states[rows], self.run[rows], self.time[rows]), torch.searchsorted(rows, place)

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
