"""The homogeneous tests of a rubber specimen, and the nominal stress that an energy gives in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from freelearn.mechanics.energy import Energy

MPA = 1e6  # Pa


@dataclass(frozen=True)
class Mode:
    """A test at stretch λ along the load: the principal stretches are λ raised to `powers`, with λ₁ = λ.

    Their product is 1 (incompressible), and the face across direction 3 is free of load.
    """

    name: str
    short: str
    powers: tuple[float, float, float]

    def invariants(self, stretch: Tensor) -> dict[str, Tensor]:
        """I₁ = Σ λᵢ² and I₂ = Σ λᵢ⁻² at stretch (N,), each (N,)."""
        squares = [stretch ** (2 * power) for power in self.powers]
        return {"i1": sum(squares, torch.zeros_like(stretch)), "i2": sum((1 / s for s in squares), 0 * stretch)}

    def nominal_stress(self, terms: Sequence[Energy], stretch: Tensor) -> Tensor:
        """Force along the load per undeformed area: stretch (N,) → (N,) Pa, positive in tension.

        P = 2 (λ₁ − λ₃²/λ₁) (Ψ₁ + λ₂² Ψ₂), Ψᵢ = ∂Ψ/∂Iᵢ: 2(λ − λ⁻²)(Ψ₁ + Ψ₂/λ) in uniaxial, 2(λ − λ⁻⁵)(Ψ₁ + λ²Ψ₂) in
        equibiaxial tension, 2(λ − λ⁻³)(Ψ₁ + Ψ₂) in pure shear (Rivlin & Saunders 1951; Ogden 1997).
        """
        at = self.invariants(stretch)
        second, third = (stretch ** (2 * power) for power in self.powers[1:])
        weight = {"i1": torch.ones_like(stretch), "i2": second}
        total = torch.zeros_like(stretch)
        for term in terms:
            for name, slope in zip(term.depends_on, term.gradient(*(at[n] for n in term.depends_on)), strict=True):
                total = total + weight[name] * slope
        return 2 * (stretch - third / stretch) * total


MODES = {
    mode.name: mode
    for mode in (
        Mode("uniaxial", "UT", (1.0, -0.5, -0.5)),
        Mode("equibiaxial", "ET", (1.0, 1.0, -2.0)),
        Mode("pure_shear", "PS", (1.0, 0.0, -1.0)),
    )
}
