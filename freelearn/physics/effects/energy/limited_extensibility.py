"""Rubber whose chains can be stretched only so far."""

import torch
from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect

# Share of the limit beyond which the logarithm continues as a parabola: a fit may step across the limit.
JOIN = 0.95
# Below this share of the limit a series replaces a logarithm that is divided by almost nothing.
SMALL = 1e-3


class Gent(Parameters):
    """beta: 1/J_m, the inverse of the largest I₁ − 3."""

    beta: Tensor = parameter(
        "1/J_m",
        "1",
        start=0.01,
        lower=0.0,
        upper=100.0,
        none=0.0,
        scale=1.0,
        prior=Prior(0.0, 1.0, "rubbers: J_m from 1 up, Gent (1996)"),
    )


class LimitedExtensibility(EnergyEffect[Gent]):
    """ΔΨ = −C1/(2β) ln(1 − β (I₁ − 3)) − C1/2 (I₁ − 3), which makes the wall Gent's solid (Gent 1996).

    β = 1/J_m: I₁ − 3 cannot reach J_m. ∂ΔΨ/∂I₁ = C1/2 y/(1 − y) with y = β (I₁ − 3), continued along its tangent
    beyond y = 0.95.
    """

    name = "limited_extensibility"
    place = 3
    suspect = "The wall locks: loads rise steeply at the largest stretches."
    source = "Gent (1996)"
    parameter_class = Gent
    depends_on = ("i1",)

    def psi(self, *invariants: Tensor, p: Gent, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        x = invariants[0] - 3
        y = p.beta * x
        below = torch.clamp(y, max=JOIN)
        past = y - below
        small = below.abs() < SMALL
        safe = torch.where(small, SMALL, below)
        # (−ln(1 − y) − y)/y² is ½ where β vanishes.
        series = 1 / 2 + below * (1 / 3 + below * (1 / 4 + below * (1 / 5 + below / 6)))
        ratio = torch.where(small, series, (-torch.log1p(-safe) - safe) / safe**2)
        limit = torch.where(past > 0, y, 1.0)  # the parabola's part is divided by β = y/x
        parabola = past * (below / (1 - below) + past / (2 * (1 - below) ** 2)) / limit
        share = torch.where(past > 0, below * below * ratio / limit, below * ratio)
        return material.C1 / 2 * x * (share + parabola)

    def psi_gradient(self, *invariants: Tensor, p: Gent, material: Material) -> tuple[Tensor, ...]:
        """As EnergyEffect.psi_gradient."""
        y = p.beta * (invariants[0] - 3)
        below = torch.clamp(y, max=JOIN)
        return (material.C1 / 2 * (below / (1 - below) + (y - below) / (1 - below) ** 2),)

    def psi_hessian(self, *invariants: Tensor, p: Gent, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        below = torch.clamp(p.beta * (invariants[0] - 3), max=JOIN)
        return ((material.C1 / 2 * p.beta / (1 - below) ** 2,),)
