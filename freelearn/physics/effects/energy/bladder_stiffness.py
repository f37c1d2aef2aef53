"""A bladder inside the tube that resists stretching by itself."""

import torch
from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect


class Bladder(Parameters):
    """stiffness: shear modulus times thickness."""

    stiffness: Tensor = parameter(
        "h",
        "N/m",
        start=100.0,
        lower=0.0,
        upper=1e6,
        none=0.0,
        scale=500.0,
        prior=Prior(0.0, 1e3, "latex bladders: 1 MPa at up to 1 mm"),
    )


class BladderStiffness(EnergyEffect[Bladder]):
    """Ψ = h/2 (I₁ − 3) per area of the bore at rest: a thin neo-Hookean bladder that the bore takes along.

    It is stretched as the bore is and not as the wall's mean, so it differs from more of C1 by how the stretch falls
    through the wall: little in a thin wall, and mostly in the pressure that it carries.
    """

    name = "bladder_stiffness"
    place = 7
    suspect = "The wall carries more pressure than its rubber can, most of all at its bore: there is a bladder inside."
    source = "Klute & Hannaford (2000), McKibben muscles with a Mooney-Rivlin bladder"
    parameter_class = Bladder
    depends_on = ("i1",)
    at_bore = True

    def psi(self, *invariants: Tensor, p: Bladder, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        return p.stiffness / 2 * (invariants[0] - 3)

    def psi_gradient(self, *invariants: Tensor, p: Bladder, material: Material) -> tuple[Tensor, ...]:
        """As EnergyEffect.psi_gradient."""
        return ((p.stiffness / 2).expand_as(invariants[0]),)

    def psi_hessian(self, *invariants: Tensor, p: Bladder, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        return ((torch.zeros_like(p.stiffness),),)
