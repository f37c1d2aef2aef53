"""What can be asked of a mask of rows, and what cannot inside torch.func.vmap, where nobody can know its values."""

from __future__ import annotations

import torch
from torch import Tensor


def all_if_known(mask: Tensor) -> bool | None:
    """Whether all rows are marked; None inside vmap.

    >>> all_if_known(torch.tensor([True, False]))
    False
    """
    try:
        return bool(mask.all())
    except RuntimeError:
        return None


def indices_if_known(mask: Tensor) -> Tensor | None:
    """Numbers of the marked rows, (n,) int64; None inside vmap.

    >>> indices_if_known(torch.tensor([True, False, True]))
    tensor([0, 2])
    """
    try:
        return torch.nonzero(mask)[:, 0]
    except RuntimeError:
        return None
