"""The accuracy of the quantities that a bed imposes and measures."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import Bed


def sensors(accuracy: Accuracy, bed: Bed) -> Tensor:
    """Standard deviations of a bed's two readings, (2,) SI."""
    return torch.tensor([getattr(accuracy, q.error) for q in bed.readings], dtype=torch.float64)


def shared(accuracy: Accuracy, bed: Bed) -> Tensor:
    """Standard deviations of what the rows of a kinematic state share, (2,) SI."""
    return torch.tensor([getattr(accuracy, q.error) for q in bed.state], dtype=torch.float64)


def changed(accuracy: Accuracy, bed: Bed, own: Tensor, common: Tensor) -> Accuracy:
    """Another accuracy of a bed's readings, `own`, and of what a state's rows share, `common`, (2,) SI each."""
    new = {q.error: float(x) for q, x in zip((*bed.readings, *bed.state), (*own, *common), strict=True)}
    return replace(accuracy, **new)
