"""What a fit minimizes: the error metric of a model over training rows, as residuals of a raw vector."""

from __future__ import annotations

from functools import cached_property

import torch
from torch import Tensor

from freelearn.measurements.error import load_scale
from freelearn.measurements.rows import Rows
from freelearn.models.base import BLOCK, Bound, Model


class Problem:
    """Residuals of a model over rows, normalized so that their sum of squares is N·E².

    residual: raw vector (p,) → (2N,), force and moment of a row side by side. scale: (2,), the loads that count as
    one; by default the largest of the rows.
    """

    def __init__(self, model: Model, rows: Rows, scale: Tensor | None = None) -> None:
        self.model = model
        self.rows = rows
        self.scale = load_scale(rows.loads) if scale is None else scale

    @cached_property
    def bound(self) -> Bound | None:
        """The model at these rows, where it has something to make once."""
        return self.model.bind(self.rows.states)

    def residual(self, vector: Tensor) -> Tensor:
        """Residuals at one raw vector, (p,) → (2N,), differentiable."""
        return self._scaled(self.model(self.rows.states, self.model.physical(vector)).loads)

    def residuals(self, vectors: Tensor) -> Tensor:
        """Residuals of several members: (members, p) → (members, 2N), in one batch."""
        if len(vectors) > 1:
            return torch.func.vmap(self.residual)(vectors)
        # Outside vmap the radial equilibrium may stop as soon as it has converged.
        recorded = torch.is_grad_enabled() and vectors.requires_grad
        if self.bound and not recorded:
            return self._scaled(self.bound.loads(vectors[0]))[None]
        return self.residual(vectors[0])[None]

    def _scaled(self, loads: Tensor) -> Tensor:
        return ((loads - self.rows.loads) / self.scale).reshape(-1)

    def jacobians(self, vectors: Tensor) -> Tensor:
        """∂residual/∂vector of several members: (members, p) → (members, 2N, p)."""
        rows = [self._row_jacobian(vector) for vector in vectors]
        known = [j for j in rows if j is not None]
        if len(known) < len(rows):
            return self._automatic(vectors)
        # Networks on many rows: megabytes, so nothing is copied without need.
        scaled = [j.div_(self.scale[:, None]).flatten(0, 1) for j in known]
        return torch.stack(scaled) if len(scaled) > 1 else scaled[0][None]

    def _row_jacobian(self, vector: Tensor) -> Tensor | None:
        return self.bound.jacobian(vector) if self.bound else self.model.row_jacobian(self.rows.states, vector)

    def _automatic(self, vectors: Tensor) -> Tensor:
        """The Jacobians by autograd.

        A row's loads depend on the parameters alone, so giving each row of each member its own copy of them lets
        two reverse passes (force, moment) return every derivative at once; forward mode pays for each parameter.
        """
        members, size = vectors.shape
        count = len(self.rows)
        blocks = []
        for rows in torch.arange(members * count, device=vectors.device).split(BLOCK):
            states = self.rows.states[rows % count]
            with torch.enable_grad():
                copies = vectors.detach()[rows // count].requires_grad_()
                force, moment = self.model.chain(states, self.model.physical(copies)).loads.unbind(-1)
                (by_force,) = torch.autograd.grad(force.sum(), copies, retain_graph=True)
                (by_moment,) = torch.autograd.grad(moment.sum(), copies)
            blocks.append(torch.stack([by_force / self.scale[0], by_moment / self.scale[1]], dim=1))
        return torch.cat(blocks).reshape(members, 2 * count, size)
