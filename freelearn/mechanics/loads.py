"""Axial force and moment that a tube in radial equilibrium exerts on its mount."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from freelearn.mechanics.equilibrium import Inflated
from freelearn.mechanics.wall import Wall


def tube_loads(wall: Wall, u: Tensor) -> Tensor:
    """Force and moment of tubes with inner radius √u in radial equilibrium: (N, 2) N, N·m.

    F = −π ∫ (2σzz − σrr − σθθ) r dr and M = −2π ∫ σθz r² dr. Neither the Lagrange multiplier nor the pressure appears:
    integrating the radial equilibrium by parts removes both (start from the paper's Eqs. force and moment).
    """
    tension, shear = wall.resultants(u)
    return torch.stack([-math.pi * tension, -2 * math.pi * shear], dim=-1)


def loads_at(inflated: Inflated) -> Tensor:
    """Force and moment (N, 2) N, N·m at the equilibrium, and beyond its end.

    There the thrust of the pressure that a ballooned wall does not carry is added: a loss that goes on past the
    equilibrium's end grows, instead of rewarding a wall too soft for the pressure.
    """
    tension, shear = inflated.wall.resultants(inflated.u)
    force = -math.pi * (tension - inflated.u * inflated.unbalanced)
    return torch.stack([force, -2 * math.pi * shear], dim=-1)
