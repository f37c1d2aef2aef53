"""What a fit minimises: the error metric of a model over training rows, as residuals of a raw vector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.evaluate.error import load_scale
from freelearn.models.base import BLOCK, Model


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

    def jacobian(self, vector: Tensor) -> Tensor:
        """∂residual/∂vector: (2N, p).

        A row's loads depend on the parameters alone, so giving each row its own copy of them lets two reverse
        passes (force, moment) return every derivative at once; forward mode pays for each parameter.
        """
        if self.model.weights:
            return torch.func.jacfwd(self.residual)(vector)
        states = self.rows.states
        blocks = []
        for first in range(0, len(self.rows), BLOCK):
            block = states[slice(first, first + BLOCK)]
            with torch.enable_grad():
                copies = vector.detach().expand(len(block), -1).clone().requires_grad_()
                force, moment = self.model(block, self.model.physical(copies)).loads.unbind(-1)
                (by_force,) = torch.autograd.grad(force.sum(), copies, retain_graph=True)
                (by_moment,) = torch.autograd.grad(moment.sum(), copies)
            blocks.append(torch.stack([by_force / self.scale[0], by_moment / self.scale[1]], dim=1))
        return torch.cat(blocks).reshape(-1, vector.shape[-1])

    def error(self, vector: Tensor) -> Tensor:
        """E at a raw vector, a scalar tensor."""
        return (self.residual(vector).square().sum() / max(len(self.rows), 1)).sqrt()
