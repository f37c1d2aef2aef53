"""Axial force and moment that a tube in radial equilibrium exerts on its mount."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from freelearn.mechanics.energy import EnergySum
from freelearn.mechanics.tube import Deformation, Tube


def tube_loads(tube: Tube, energy: EnergySum, u: Tensor) -> Tensor:
    """Force and moment of tubes with inner radius √u in radial equilibrium: (N, 2) N, N·m.

    F = −π ∫ (2σzz − σrr − σθθ) r dr and M = −2π ∫ σθz r² dr with σ = 2Ψ₁B + 2Ψ₂(I₁B − B²) + 2Ψ₄ a⊗a. Neither the
    Lagrange multiplier nor the pressure appears: integrating the radial equilibrium by parts removes both
    (start from the paper's Eqs. force and moment).
    """
    at = Deformation(tube, u)
    gradient = energy.gradient(at)
    tension: Tensor | float = 0.0  # (2σzz − σrr − σθθ)/2
    shear: Tensor | float = 0.0  # σθz r/2
    swirl = at.r2 * (tube.twist_rate * tube.axial)  # B_θz r
    if "i1" in gradient:
        tension = gradient["i1"] * (2 * tube.axial2 - at.b_rr - at.r2 * tube.hoop)
        shear = gradient["i1"] * swirl
    if "i2" in gradient:
        # The diagonal of I₁B − B², simplified with det B = 1 in the (θ, z) block.
        rr = at.b_rr * (at.r2 * tube.hoop + tube.axial2)
        thetatheta = at.b_rr * (at.r2 * tube.hoop) + 1 / at.b_rr
        zz = at.b_rr * tube.axial2 + 1 / at.b_rr
        tension = tension + gradient["i2"] * (2 * zz - rr - thetatheta)
        shear = shear + gradient["i2"] * (at.b_rr * swirl)
    if "i4" in gradient:
        tension = tension + gradient["i4"] * (2 * tube.fiber_axial2 - at.r2 * tube.fiber_hoop2)
        shear = shear + gradient["i4"] * (at.r2 * tube.fiber_hoop * tube.fiber_axial)
    force = -math.pi * (tube.weight * tension).sum(-2)
    moment = -2 * math.pi * (tube.weight * shear).sum(-2)
    return torch.stack([force, moment], dim=-1)
