"""Two linear equations in every row."""

from __future__ import annotations

import torch
from torch import Tensor


def determinant(m: Tensor) -> Tensor:
    """Of every row: (N, 2, 2) → (N,)."""
    return m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0]


def divide(g: Tensor, m: Tensor) -> Tensor:
    """m⁻¹ g of every row: (N, 2), (N, 2, 2) → (N, 2)."""
    first = m[:, 1, 1] * g[:, 0] - m[:, 0, 1] * g[:, 1]
    second = m[:, 0, 0] * g[:, 1] - m[:, 1, 0] * g[:, 0]
    return torch.stack([first, second], dim=-1) / determinant(m)[:, None]
