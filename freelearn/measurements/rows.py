"""Configurations with what was measured there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from torch import Tensor

from freelearn.measurements.states import States


@dataclass(frozen=True)
class Rows:
    """Configurations with their measured loads (N, 2) N, N·m and the number of their kinematic state (N,)."""

    states: States
    loads: Tensor
    state: np.ndarray

    def __len__(self) -> int:
        return len(self.states)

    def __getitem__(self, rows: Tensor) -> Rows:
        return Rows(self.states[rows], self.loads[rows], self.state[rows.numpy()])
