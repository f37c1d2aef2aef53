"""What a fit minimises: the error metric of a model over training rows, as residuals of a raw vector."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.measurements.error import load_scale
from freelearn.measurements.rows import Rows
from freelearn.models.base import BLOCK, Model


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

    def residuals(self, vectors: Tensor) -> Tensor:
        """Residuals of several members: (members, p) → (members, 2N), in one batch."""
        if len(vectors) == 1:  # outside vmap the radial equilibrium may stop as soon as it has converged
            return self.residual(vectors[0])[None]
        return torch.func.vmap(self.residual)(vectors)

    def jacobians(self, vectors: Tensor) -> Tensor:
        """∂residual/∂vector of several members: (members, p) → (members, 2N, p).

        A row's loads depend on the parameters alone, so giving each row of each member its own copy of them lets
        two reverse passes (force, moment) return every derivative at once; forward mode pays for each parameter.
        """
        members, size = vectors.shape
        count = len(self.rows)
        exact = [self.model.row_jacobian(self.rows.states, vector) for vector in vectors]
        if exact[0] is not None:
            return torch.stack([(j / self.scale[:, None]).reshape(2 * count, size) for j in exact if j is not None])
        blocks = []
        for rows in torch.arange(members * count).split(BLOCK):
            states = self.rows.states[rows % count]
            with torch.enable_grad():
                copies = vectors.detach()[rows // count].requires_grad_()
                force, moment = self.model.chain(states, self.model.physical(copies)).loads.unbind(-1)
                (by_force,) = torch.autograd.grad(force.sum(), copies, retain_graph=True)
                (by_moment,) = torch.autograd.grad(moment.sum(), copies)
            blocks.append(torch.stack([by_force / self.scale[0], by_moment / self.scale[1]], dim=1))
        return torch.cat(blocks).reshape(members, 2 * count, size)
