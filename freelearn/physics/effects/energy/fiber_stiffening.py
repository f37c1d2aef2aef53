"""Fiber that stiffens as it is stretched."""

import torch
from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect

# Exponent beyond which the exponential continues along its tangent: a fit may try a wild k2.
JOIN = 10.0
# Below this exponent a series replaces an exponential that is divided by almost nothing.
SMALL = 1e-3


class Holzapfel(Parameters):
    """k2: exponent's factor of (I₄ − 1)²."""

    k2: Tensor = parameter(
        "k₂",
        "1",
        start=1.0,
        lower=0.0,
        upper=1e5,
        none=0.0,
        scale=100.0,
        prior=Prior(0.0, 100.0, "crimped fibers: Holzapfel et al. (2000)"),
    )


class FiberStiffening(EnergyEffect[Holzapfel]):
    """ΔΨ = C2/(2 k2) (exp(k2 (I₄ − 1)²) − 1) − C2/2 (I₄ − 1)²: the fiber becomes exponential.

    ∂ΔΨ/∂I₄ = C2 x (eᶻ − 1) with x = I₄ − 1 and z = k2 x²; beyond z = 10 eᶻ goes on along its tangent.
    """

    name = "fiber_stiffening"
    place = 4
    suspect = "Threads straighten: the fiber is soft at first and stiff once it carries load."
    source = "Holzapfel, Gasser & Ogden (2000)"
    parameter_class = Holzapfel
    depends_on = ("i4",)

    def psi(self, *invariants: Tensor, p: Holzapfel, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        x = invariants[0] - 1
        z = p.k2 * x * x
        below = torch.clamp(z, max=JOIN)
        past = z - below
        small = below < SMALL
        safe = torch.where(small, SMALL, below)
        # (eᶻ − 1)/z − 1, and the tangent's part over z.
        series = below * (1 / 2 + below * (1 / 6 + below * (1 / 24 + below / 120)))
        gain = torch.where(small, series, torch.expm1(safe) / safe - 1)
        tangent = (torch.expm1(below) + past * (1 + past / 2) * torch.exp(below)) / torch.where(past > 0, z, 1.0) - 1
        return material.C2 / 2 * x * x * torch.where(past > 0, tangent, gain)

    def psi_gradient(self, *invariants: Tensor, p: Holzapfel, material: Material) -> tuple[Tensor, ...]:
        """As EnergyEffect.psi_gradient."""
        x = invariants[0] - 1
        z = p.k2 * x * x
        below = torch.clamp(z, max=JOIN)
        return (material.C2 * x * (torch.expm1(below) + (z - below) * torch.exp(below)),)

    def psi_hessian(self, *invariants: Tensor, p: Holzapfel, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        x = invariants[0] - 1
        z = p.k2 * x * x
        below = torch.clamp(z, max=JOIN)
        growth = torch.exp(below)
        return ((material.C2 * (torch.expm1(below) + (z - below + 2 * z) * growth),),)
