"""What a fit minimises: the error metric of a model over training rows, as residuals of a raw vector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from torch import Tensor

from freelearn.data.states import States
from freelearn.evaluate.error import load_scale
from freelearn.models.base import Model


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


class Problem:
    """Residuals of a model over rows, normalised so that their sum of squares is N·E².

    residual: raw vector (p,) → (2N,), force and moment of a row side by side.
    """

    def __init__(self, model: Model, rows: Rows, scale: Tensor | None = None) -> None:
        self.model = model
        self.rows = rows
        self.scale = load_scale(rows.loads) if scale is None else scale

    def residual(self, vector: Tensor) -> Tensor:
        predicted = self.model(self.rows.states, self.model.physical(vector)).loads
        return ((predicted - self.rows.loads) / self.scale).reshape(-1)

    def error(self, vector: Tensor) -> Tensor:
        """E at a raw vector, a scalar tensor."""
        return (self.residual(vector).square().sum() / max(len(self.rows), 1)).sqrt()
