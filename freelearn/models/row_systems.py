"""Two linear equations in every row."""

from __future__ import annotations

import torch
from torch import Tensor

# The square of a step that is none.
SMALLEST = 1e-30


def determinant(m: Tensor) -> Tensor:
    """Of every row: (N, 2, 2) → (N,)."""
    return m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0]


def divide(g: Tensor, m: Tensor) -> Tensor:
    """m⁻¹ g of every row: (N, 2), (N, 2, 2) → (N, 2)."""
    first = m[:, 1, 1] * g[:, 0] - m[:, 0, 1] * g[:, 1]
    second = m[:, 0, 0] * g[:, 1] - m[:, 1, 0] * g[:, 0]
    return torch.stack([first, second], dim=-1) / determinant(m)[:, None]


def mended(slope: Tensor, change: Tensor, step: Tensor, size: Tensor) -> Tensor:
    """A slope (N, 2, 2) that gives the change (N, 2) seen along a step (N, 2), and is as it was across: Broyden (1965).

    size: what counts as one of either quantity, (N, 2)."""
    lacking = change - (slope * step[:, None, :]).sum(-1)
    along = step / size**2
    reach = (along * step).sum(-1).clamp_min(SMALLEST)
    return slope + lacking[:, :, None] * (along / reach[:, None])[:, None, :]
