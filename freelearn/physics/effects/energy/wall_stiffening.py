"""Rubber that stiffens at large stretch."""

from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect


class Yeoh(Parameters):
    """C20: coefficient of (I₁ − 3)²."""

    C20: Tensor = parameter(
        "C₂₀",
        "Pa",
        start=1e4,
        lower=0.0,
        none=0.0,
        scale=3e5,
        prior=Prior(0.0, 1e6, "Yeoh fits of rubbers: Yeoh (1993)"),
    )


class WallStiffening(EnergyEffect[Yeoh]):
    """ΔΨ = C20 (I₁ − 3)², the second term of Yeoh's energy (Yeoh 1993)."""

    name = "wall_stiffening"
    place = 2
    suspect = "The loads fall short at large stretch and twist although they are right near the reference state."
    source = "Yeoh (1993)"
    parameter_class = Yeoh
    depends_on = ("i1",)

    def psi(self, *invariants: Tensor, p: Yeoh, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        return p.C20 * (invariants[0] - 3) ** 2

    def psi_gradient(self, *invariants: Tensor, p: Yeoh, material: Material) -> tuple[Tensor, ...]:
        """As EnergyEffect.psi_gradient."""
        return (2 * p.C20 * (invariants[0] - 3),)

    def psi_hessian(self, *invariants: Tensor, p: Yeoh, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        return ((2 * p.C20,),)
