"""How well a model's raw vector is known, and what that makes of its outputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from freelearn.physics.chain.model import Model


class Spread(NamedTuple):
    """covariance (N, 2, 2) of two outputs' misses; lost (N, 2) bool: outputs that hang on a parameter which nobody
    knows."""

    covariance: Tensor
    lost: Tensor


@dataclass(frozen=True)
class RawCovariance:
    """matrix (p, p): covariance of a model's raw vector, zero where it is not known; undetermined (p,) bool: which of
    its numbers are not. Of a model of which nothing is known neither says anything, nor of a network's weights."""

    matrix: Tensor
    undetermined: Tensor

    @classmethod
    def from_model(cls, model: Model, covariance: np.ndarray) -> RawCovariance:
        """From that of the declared parameters, SI (k, k), NaN where one is not known."""
        vector = model.vector().detach()
        total = torch.zeros(len(vector), len(vector), dtype=torch.float64)
        undetermined = torch.zeros(len(vector), dtype=torch.bool)
        count = len(model.declared)
        if not count or not np.isfinite(covariance).any():
            return cls(total, undetermined)
        known = np.isfinite(np.diagonal(covariance))
        # d value / d raw: the value itself where its logarithm was fitted.
        values = model.scalars()
        rate = torch.tensor([values[n] if p.log else 1.0 for n, p in model.declared.items()], dtype=torch.float64)
        inside = torch.as_tensor(np.where(known[:, None] & known, covariance, 0.0))
        total[-count:, -count:] = inside / rate.clamp_min(1e-300)[:, None] / rate.clamp_min(1e-300)
        undetermined[-count:] = torch.as_tensor(~known)
        return cls(total, undetermined)

    @property
    def silent(self) -> bool:
        """Whether it says nothing, so that no derivative is needed."""
        return not bool((self.matrix != 0).any() | self.undetermined.any())

    def spread(self, rate: Tensor) -> Spread:
        """Of outputs with these derivatives by the raw vector, (N, 2, p)."""
        lost = (rate[:, :, self.undetermined].abs() > 0).any(-1)
        return Spread(rate @ self.matrix @ rate.transpose(1, 2), lost)
