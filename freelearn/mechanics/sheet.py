"""The nominal stress of an incompressible sheet that is stretched in its two directions."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from freelearn.mechanics.energy import Energy

MPA = 1e6  # Pa


def nominal_stress(terms: Sequence[Energy], along: Tensor, across: Tensor) -> Tensor:
    """Force in a direction per undeformed area: the stretches along and across it, each (N,) → (N,) Pa, + in tension.

    P₁ = 2 (λ₁ − λ₃²/λ₁) (Ψ₁ + λ₂² Ψ₂), Ψᵢ = ∂Ψ/∂Iᵢ, where λ₃ = 1/(λ₁λ₂) and the sheet's faces are free of load (Rivlin
    & Saunders 1951; Ogden 1997). λ₂ is λ₁^-½ in uniaxial and λ₁ in equibiaxial tension, 1 in pure shear.
    """
    first, second = along**2, across**2
    third = 1 / (first * second)
    at = {"i1": first + second + third, "i2": 1 / first + 1 / second + 1 / third}
    weight = {"i1": torch.ones_like(second), "i2": second}
    total = torch.zeros_like(along)
    for term in terms:
        for name, slope in zip(term.depends_on, term.gradient(*(at[n] for n in term.depends_on)), strict=True):
            total = total + weight[name] * slope
    return 2 * (along - third / along) * total
