"""Noise that grows with the load or with the pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.inference.tails import SPREAD, Tails

LOAD, PRESSURE = "load", "pressure"
# Increase of the standard deviation, from none to the largest load or pressure, that is told apart.
STEPS = (0.5, 1.0, 2.0, 4.0, 8.0)
# Log-likelihood by which growing noise must do better than even noise.
WORTH = 6.0


@dataclass(frozen=True)
class Growth:
    """Standard deviations grow in proportion to 1 + amount × (|load| or pressure) / its largest. kind: of which."""

    kind: str = ""
    amount: float = 0.0

    def factor(self, loads: Tensor, pressure: Tensor) -> Tensor:
        """Of the standard deviation of every reading, (N, 2)."""
        return 1 + self.amount * _relative(self.kind, loads, pressure)


EVEN = Growth()


def grown(
    errors: Tensor, loads: Tensor, pressure: Tensor, tails: Tails, told: Tensor | None = None
) -> tuple[Growth, Tensor]:
    """How errors (N, 2) grow, and the scale (2,) of those at no load or pressure, in the errors' unit.

    told: (N, 2) bool, the errors that there are, all by default."""
    there = np.ones(errors.shape, dtype=bool) if told is None else told.numpy()
    choices = [EVEN, *(Growth(kind, amount) for kind in (LOAD, PRESSURE) for amount in STEPS)]
    tried = [_likelihood(errors, choice.factor(loads, pressure), tails, there) for choice in choices]
    best = int(np.argmax([likelihood for likelihood, _ in tried]))
    if tried[best][0] < tried[0][0] + WORTH:
        best = 0
    return choices[best], torch.as_tensor(tried[best][1])


def _likelihood(errors: Tensor, factor: Tensor, tails: Tails, told: np.ndarray) -> tuple[float, np.ndarray]:
    """Log-likelihood of errors whose scale grows by a factor, (N, 2) each, that scale refitted, and the scale (2,)."""
    z, scale = (errors / factor).numpy(), np.ones(2)
    for _ in range(4):
        good = tails.good(z / scale) * told
        weight = good * tails.weight(z / scale)
        each = np.sqrt((weight * z**2).sum(0) / np.maximum(good.sum(0), 1.0))
        scale = np.where(told.any(0), np.maximum(each, 1e-9), 1.0)
    # Readings that slipped are in the likelihood too: else even noise would be spared what it makes of large errors.
    right = (1 - tails.slipped) * np.exp(tails.log_density(z / scale)) / scale / factor.numpy()
    return float(np.log(right + max(tails.slipped, 1e-6) / SPREAD)[told].sum()), scale


def _relative(kind: str, loads: Tensor, pressure: Tensor) -> Tensor:
    if kind == PRESSURE:
        size = pressure.abs()[:, None].expand_as(loads)
    elif kind == LOAD:
        size = loads.abs()
    else:
        return torch.zeros_like(loads)
    return size / size.amax(0).clamp_min(1e-300)
