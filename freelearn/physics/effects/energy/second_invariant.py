"""Rubber whose resistance to shear and to stretch differ."""

import torch
from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect


class Mooney(Parameters):
    """C01: part of the shear modulus that goes with I₂."""

    C01: Tensor = parameter(
        "C₀₁",
        "Pa",
        start=2e4,
        lower=0.0,
        none=0.0,
        scale=1e5,
        prior=Prior(0.0, 1e6, "Mooney-Rivlin fits of rubbers: Treloar (1975)"),
    )


class SecondInvariant(EnergyEffect[Mooney]):
    """ΔΨ = C01/2 (I₂ − 3), the second term of Mooney-Rivlin; the wall's shear modulus is then C1 + C01."""

    name = "second_invariant"
    place = 1
    suspect = "The wall is right in tension but wrong in twist or compression: a neo-Hookean solid is too simple."
    source = "Mooney (1940); Rivlin (1948)"
    parameter_class = Mooney
    depends_on = ("i2",)

    def psi(self, *invariants: Tensor, p: Mooney, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        return p.C01 / 2 * (invariants[0] - 3)

    def psi_gradient(self, *invariants: Tensor, p: Mooney, material: Material) -> tuple[Tensor, ...]:
        """As EnergyEffect.psi_gradient."""
        return ((p.C01 / 2).expand_as(invariants[0]),)

    def psi_hessian(self, *invariants: Tensor, p: Mooney, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        return ((torch.zeros_like(p.C01),),)
