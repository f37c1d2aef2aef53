"""Fibers that scatter about their mean direction."""

from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect


class Dispersion(Parameters):
    """kappa: 0 aligned, 1/3 isotropic."""

    kappa: Tensor = parameter(
        "κ",
        "1",
        start=0.02,
        lower=0.0,
        upper=1 / 3,
        none=0.0,
        scale=0.02,
        prior=Prior(0.0, 0.05, "wound threads are nearly aligned: Gasser et al. (2006)"),
    )


class FiberDispersion(EnergyEffect[Dispersion]):
    """ΔΨ = C2/2 E² − C2/2 (I₄ − 1)², E = κ (I₁ − 3) + (1 − 3κ)(I₄ − 1): κ = 0 aligned, κ = 1/3 isotropic."""

    name = "fiber_dispersion"
    place = 6
    suspect = "Fibers are wound unevenly or cross each other, so the wall is stiff off the fiber angle too."
    source = "Gasser, Ogden & Holzapfel (2006)"
    parameter_class = Dispersion
    depends_on = ("i1", "i4")

    def psi(self, *invariants: Tensor, p: Dispersion, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        along = invariants[1] - 1
        strain = p.kappa * (invariants[0] - 3) + (1 - 3 * p.kappa) * along
        return material.C2 / 2 * (strain**2 - along**2)

    def psi_gradient(self, *invariants: Tensor, p: Dispersion, material: Material) -> tuple[Tensor, ...]:
        """As EnergyEffect.psi_gradient."""
        along = invariants[1] - 1
        strain = p.kappa * (invariants[0] - 3) + (1 - 3 * p.kappa) * along
        return material.C2 * p.kappa * strain, material.C2 * ((1 - 3 * p.kappa) * strain - along)

    def psi_hessian(self, *invariants: Tensor, p: Dispersion, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        wall, along = p.kappa, 1 - 3 * p.kappa
        C2 = material.C2
        return (C2 * wall**2, C2 * wall * along), (C2 * wall * along, C2 * (along**2 - 1))
