"""A wall whose stress is linear in the finite strain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from torch import Tensor

from freelearn.mechanics.energy import Energy


@dataclass(frozen=True)
class LinearMaterial(Energy):
    """Ψ = C₁ tr E² = C₁/4 (I₁² − 2 I₂ − 2 I₁ + 3), E the Green-Lagrange strain, C₁ the shear modulus [Pa].

    Incompressible St. Venant-Kirchhoff material (Holzapfel 2000, Section 6.5): Hooke's law kept at large deformation.
    """

    C1: Tensor
    depends_on: ClassVar[tuple[str, ...]] = ("i1", "i2")

    def psi(self, *invariants: Tensor) -> Tensor:
        """Ψ [Pa] at I₁ and I₂."""
        i1, i2 = invariants
        return self.C1 / 4 * (i1 * i1 - 2 * i2 - 2 * i1 + 3)
