"""Configurations with what was measured there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
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
        """The rows of these numbers (n,) int64, or marked by (N,) bool."""
        there = rows.to(self.loads.device)
        return Rows(self.states[there], self.loads[there], self.state[rows.cpu().numpy()])

    def to(self, device: torch.device | str) -> Rows:
        """The same rows with their tensors on a device; themselves where they are there already."""
        if self.loads.device == torch.device(device):
            return self
        return Rows(self.states.to(device), self.loads.to(device), self.state)
