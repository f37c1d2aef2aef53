"""Rubber whose second-invariant part weakens as it is stretched."""

from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect


class GentThomas(Parameters):
    """modulus: part of the shear modulus at rest that goes with ln I₂."""

    modulus: Tensor = parameter(
        "C_ln",
        "Pa",
        start=2e4,
        lower=0.0,
        none=0.0,
        scale=1e5,
        prior=Prior(0.0, 1e6, "as Mooney's C01: Gent & Thomas (1958)"),
    )


class SecondInvariantLog(EnergyEffect[GentThomas]):
    """ΔΨ = (3 C_ln/2) ln(I₂/3), Gent and Thomas's second term; the wall's shear modulus at rest is then C1 + C_ln."""

    name = "second_invariant_log"
    place = 1
    suspect = "As of second_invariant, but only near rest: at large stretch that term would be too much."
    source = "Gent & Thomas (1958)"
    parameter_class = GentThomas
    depends_on = ("i2",)

    def psi(self, *invariants: Tensor, p: GentThomas, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        return 3 / 2 * p.modulus * (invariants[0] / 3).log()

    def psi_gradient(self, *invariants: Tensor, p: GentThomas, material: Material) -> tuple[Tensor, ...]:
        """As EnergyEffect.psi_gradient."""
        return (3 / 2 * p.modulus / invariants[0],)

    def psi_hessian(self, *invariants: Tensor, p: GentThomas, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        return ((-3 / 2 * p.modulus / invariants[0] ** 2,),)
