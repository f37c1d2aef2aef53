"""Configurations with what was measured there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.beds import DEAD_LOAD, KINEMATIC
from freelearn.data.columns import shown_readings
from freelearn.data.corners import untold, with_calm, with_corners
from freelearn.data.levels import Levels
from freelearn.data.states import States, kinematic_state


@dataclass(frozen=True)
class Readings:
    """What N rows show in the two channels of their bed.

    value: (N, 2) SI, zero where nothing was measured. present: (N, 2) bool. slack: (N,) bool, rows in which the tube
    hangs loose: their force is censored, a predicted push costs nothing and a predicted pull counts in full.
    """

    value: Tensor
    present: Tensor
    slack: Tensor

    @classmethod
    def whole(cls, value: Tensor) -> Readings:
        """Readings (N, 2) of which none is blank."""
        return cls(value, torch.ones_like(value, dtype=torch.bool), torch.zeros(len(value), dtype=torch.bool))

    @classmethod
    def from_table(cls, table: pd.DataFrame, predicted: bool = False) -> Readings:
        """From a measurement table; predicted: what a model says there, of the columns of predictions.csv."""
        value, present, slack = shown_readings(table, predicted)
        return cls(torch.as_tensor(value), torch.as_tensor(present), torch.as_tensor(slack))

    def __len__(self) -> int:
        return len(self.value)

    def __getitem__(self, rows: Tensor | slice) -> Readings:
        return Readings(self.value[rows], self.present[rows], self.slack[rows])

    def to(self, device: torch.device | str) -> Readings:
        """The same readings on a device."""
        return Readings(self.value.to(device), self.present.to(device), self.slack.to(device))

    @cached_property
    def plain(self) -> bool:
        """Whether every reading is there and none is censored."""
        return bool(self.present.all()) and not self.loose

    @cached_property
    def loose(self) -> bool:
        """Whether a tube hangs loose anywhere: what counts then depends on what is predicted."""
        return bool(self.slack.any())

    @cached_property
    def count(self) -> int:
        """How many readings there are."""
        # Not their sum, for which every mark becomes a number first.
        return int(self.present.count_nonzero())

    def missed(self, predicted: Tensor) -> Tensor:
        """Predicted − measured where it counts, (N, 2): zero where nothing was measured, and for a push on a tube that
        hangs loose."""
        if self.plain:
            return predicted - self.value
        return torch.where(self.informative_mask(predicted), predicted - self.value, 0.0)

    def informative_mask(self, predicted: Tensor) -> Tensor:
        """Readings whose miss changes with the prediction (N, 2), (N, 2) bool."""
        loose = self.slack & (predicted[..., 0] >= self.value[..., 0])
        return self.present & ~torch.stack([loose, torch.zeros_like(loose)], dim=-1)


def loads_of(table: pd.DataFrame) -> Tensor:
    """What a table's rows show, (N, 2) SI: force and moment, or what their bed measures in their place."""
    return Readings.from_table(table).value


@dataclass(frozen=True)
class Rows:
    """Configurations, what was read there, and the number of their kinematic state (N,). visit: of their visit, (N,),
    where a state is several visits of one place. levels: where pressures are those of levels that were set, see there.
    """

    states: States
    readings: Readings
    state: np.ndarray
    visit: np.ndarray | None = None
    levels: Levels | None = None

    @property
    def visits(self) -> np.ndarray:
        """Number of each row's visit, (N,)."""
        return self.state if self.visit is None else self.visit

    @classmethod
    def from_table(cls, table: pd.DataFrame) -> Rows:
        """All rows of a measurement table; of a log, with the corners of its pressure between them, and its noise."""
        rows = cls.straight(table)
        return replace(rows, states=with_calm(with_corners(rows.states)))

    @classmethod
    def straight(cls, table: pd.DataFrame) -> Rows:
        """The same, the pressures of a log going straight from row to row: as what is asked of a model follows them."""
        return cls(States.from_table(table), Readings.from_table(table), kinematic_state(table))

    def told(self) -> Rows:
        """The same rows; of a log without what was read right after a turn that no row tells (corners.untold)."""
        dark = torch.as_tensor(untold(self.states))
        if not bool((dark[:, None] & self.readings.present).any()):
            return self
        readings = replace(self.readings, present=self.readings.present & ~dark[:, None])
        return replace(self, readings=readings)

    @classmethod
    def whole(cls, states: States, loads: Tensor, state: np.ndarray | None = None) -> Rows:
        """Rows of whose readings (N, 2) SI none is blank; state: each row's own by default."""
        return cls(states, Readings.whole(loads), np.arange(len(states)) if state is None else state)

    @property
    def loads(self) -> Tensor:
        """The readings' values, (N, 2) SI: force and moment, or what the bed measures in their place."""
        return self.readings.value

    @property
    def as_loads(self) -> Rows:
        """Under a dead load the same rows as of a kinematic bed that imposed the places measured (those that were not,
        at rest) and measured the loads: good enough for a fit to start from. Of other beds the rows themselves."""
        if self.states.bed is not DEAD_LOAD:
            return self
        place, hung = self.readings.value, torch.stack([self.states.force, self.states.moment], dim=-1)
        states = self.states.replace(
            bed=KINEMATIC, length=self.states.reference_length + place[:, 0], twist=place[:, 1]
        )
        return Rows(states, Readings.whole(hung), self.state, self.visit)

    def __len__(self) -> int:
        return len(self.states)

    def __getitem__(self, rows: Tensor | slice) -> Rows:
        """The rows of these numbers (n,) int64, or marked by (N,) bool, or of a slice, which shares their memory."""
        there = rows if isinstance(rows, slice) else rows.to(self.loads.device)
        own = rows if isinstance(rows, slice) else rows.cpu().numpy()
        visit = None if self.visit is None else self.visit[own]
        levels = None if self.levels is None else self.levels.of(there)
        return Rows(self.states[there], self.readings[there], self.state[own], visit, levels)

    def to(self, device: torch.device | str) -> Rows:
        """The same rows with their tensors on a device; themselves where they are there already."""
        if self.loads.device == torch.device(device):
            return self
        return Rows(self.states.to(device), self.readings.to(device), self.state, self.visit, self.levels)
