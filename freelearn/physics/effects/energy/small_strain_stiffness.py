"""A filled rubber that is stiffer at small strains than at larger ones."""

import torch
from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect


class Softening(Parameters):
    """modulus: that is lost with strain; decay: how soon, by I₁ − 3."""

    modulus: Tensor = parameter(
        "α",
        "Pa",
        start=1e5,
        lower=0.0,
        upper=1e9,
        none=0.0,
        scale=3e5,
        prior=Prior(0.0, 3e6, "rubber filled with carbon black: Payne (1962)"),
    )
    decay: Tensor = parameter(
        "β",
        "1",
        start=5.0,
        lower=0.3,
        upper=300.0,
        log=True,
        scale=5.0,
        prior=Prior(5.0, 1.2, "gone at strains of 10 to 100 %: Yeoh (1993)"),
    )


class SmallStrainStiffness(EnergyEffect[Softening]):
    """Ψ += α/(2β) (1 − e^(−β (I₁ − 3))): a further shear modulus α at rest, of which 1/e is left at I₁ − 3 = 1/β."""

    name = "small_strain_stiffness"
    place = 4
    suspect = "The wall is stiff near its rest and soft beyond: rubber filled with carbon black, a braid cast into it."
    source = "Yeoh (1993), exponential term; Payne (1962)"
    parameter_class = Softening
    depends_on = ("i1",)

    def psi(self, *invariants: Tensor, p: Softening, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        return -p.modulus / (2 * p.decay) * torch.expm1(-p.decay * (invariants[0] - 3))

    def psi_gradient(self, *invariants: Tensor, p: Softening, material: Material) -> tuple[Tensor, ...]:
        """α/2 e^(−β (I₁ − 3))."""
        return (p.modulus / 2 * torch.exp(-p.decay * (invariants[0] - 3)),)

    def psi_hessian(self, *invariants: Tensor, p: Softening, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """−αβ/2 e^(−β (I₁ − 3))."""
        return ((-p.decay * p.modulus / 2 * torch.exp(-p.decay * (invariants[0] - 3)),),)
