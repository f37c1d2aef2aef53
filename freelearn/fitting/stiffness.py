"""The positive semidefinite stiffness matrix that fits best: a small convex problem with one global answer."""

from __future__ import annotations

import math

import torch
from torch import Tensor

DIRECTIONS = 720
REFINEMENTS = 40


def best_stiffness(columns: Tensor, target: Tensor) -> tuple[float, float, float]:
    """(ka, kb, kc) with the least ‖columns (ka, kb, kc) − target‖² over K ⪰ 0; columns (m, 3), target (m,).

    Where the unconstrained answer is not positive definite, the constrained one lies on the edge of the cone, and
    so has rank one: K = s v vᵀ with s ≥ 0. For a direction v the best s is known, which leaves one angle to search.
    An entry whose column is zero (kb of an actuator that is never twisted) may come out as anything.
    """
    # Scaled so that both diagonal entries act alike: units must not decide the resolution of the angle.
    unit = columns[:, :2].norm(dim=0).sqrt()
    unit = torch.where(unit > 0, unit, 1.0)
    scale = torch.stack([unit[0] ** 2, unit[1] ** 2, unit[0] * unit[1]])
    triangle = torch.linalg.qr(torch.cat([columns / scale, target[:, None]], dim=1), mode="r").R
    small, goal = triangle[:, :3], triangle[:, 3]
    # The default driver exchanges columns by what it finds in memory that nobody has written: no two runs were alike.
    free = torch.linalg.lstsq(small, goal[:, None], driver="gelsd").solution[:, 0]
    if free[0] > 0 and free[0] * free[1] > free[2] ** 2:
        ka, kb, kc = (free / scale).tolist()
        return ka, kb, kc

    def edge(angle: Tensor) -> tuple[Tensor, Tensor]:
        """Least cost on the ray at each angle, and K there in scaled units: (n,), (n, 3)."""
        x, y = torch.cos(angle), torch.sin(angle)
        ray = torch.stack([x * x, y * y, x * y], dim=-1)
        shown = ray @ small.T
        size = ((shown @ goal) / shown.square().sum(-1).clamp_min(1e-300)).clamp_min(0)
        return (size[:, None] * shown - goal).square().sum(-1), size[:, None] * ray

    low, high = 0.0, math.pi
    for _ in range(REFINEMENTS):
        angles = torch.linspace(low, high, DIRECTIONS, dtype=torch.float64)
        cost, k = edge(angles)
        best = int(cost.argmin())
        width = (high - low) / (DIRECTIONS - 1)
        low, high = float(angles[best]) - width, float(angles[best]) + width
        if width < 1e-15:
            break
    ka, kb, kc = (k[best] / scale).tolist()
    return ka, kb, kc
