"""The paper's error metric."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

# Share of the loads that `usual_scale` takes for nearly all, and its smallest value.
NEARLY_ALL, SMALLEST = 0.95, 1e-300


class Error(NamedTuple):
    """E = sqrt(E_force² + E_moment²), each a share of the largest measured load of the set; n rows scored."""

    E: float
    E_force: float
    E_moment: float
    n: int


def load_scale(measured: Tensor) -> Tensor:
    """Largest |force| and |moment| of a set, (2,) N, N·m: what E is normalized by. Zero loads scale by one."""
    largest = measured.abs().amax(0)
    return torch.where(largest > 0, largest, 1.0)


def usual_scale(measured: Tensor) -> Tensor:
    """Load below which nearly all |force| and |moment| are, (2,) N, N·m: the largest of them may have slipped. Never
    zero, also of loads that are."""
    return measured.abs().quantile(NEARLY_ALL, dim=0).clamp_min(SMALLEST)


def set_error(measured: Tensor, predicted: Tensor, usable: Tensor) -> Error:
    """Error of predictions (N, 2) on the rows marked usable; the loads' maxima are those of all N measured rows.

    E = sqrt(mean(((F − F̂)/max|F|)² + ((M − M̂)/max|M|)²)) (the paper's Eq. errorObj). NaN without usable rows.
    """
    scaled = ((predicted - measured) / load_scale(measured))[usable]
    force, moment = scaled.square().mean(0).tolist() if len(scaled) else (float("nan"),) * 2
    return Error((force + moment) ** 0.5, force**0.5, moment**0.5, len(scaled))


def common(*usable: Tensor) -> Tensor:
    """Rows marked usable by every one of several models, (N,) bool: only on these may their errors be compared.

    Each model's own error leaves out the rows that it cannot answer, often its worst ones.

    >>> common(torch.tensor([True, True, False]), torch.tensor([True, False, True])).tolist()
    [True, False, False]
    """
    return torch.stack(usable).all(0)
