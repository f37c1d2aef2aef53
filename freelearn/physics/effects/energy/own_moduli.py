"""Tubes, on one end block or measured one after another, whose walls or fibers are not of one stock."""

from typing import ClassVar

import torch
from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect
from freelearn.physics.mechanics.energy import Energy, NeoHookean, StandardFiber
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.mechanics.wall import Wall


class Stock(Parameters):
    """log_ratio: natural logarithm of a tube's modulus over the first one's; 0.1 is one 10 % stiffer."""

    log_ratio: Tensor = parameter(
        "a",
        "1",
        start=0.0,
        lower=-3.0,
        upper=3.0,
        none=0.0,
        scale=0.1,
        per_sample=True,
        per_member=True,
        # Each of the two moduli ×÷ 1.3; that of the first is in all ratios.
        prior=Prior(
            0.0, 0.4, "stocks of one kind: ×÷ 1.3, as silicones of one hardness (Marechal et al. 2021)", common=0.5
        ),
    )


class WallModulus(EnergyEffect[Stock]):
    """Ψ of actuator i += (C1ᵢ − C1)/2 (I₁ − 3), C1ᵢ = C1 e^a: a neo-Hookean wall of a modulus of its own.

    C1 is the first actuator's, to which each other has a ratio: all together are no more than their moduli. Tubes of
    several stocks, coats that were cured longer, threads that stiffen the rubber between them by how densely they are
    wound. Of one actuator alone it is C1 itself. The fibers, and what other effects add to the wall, are the same for
    all.
    """

    name = "wall_modulus"
    place = 7
    of_each = True
    compares = True
    suspect = (
        "Actuators of one drawing are stiff or soft, each by its share: on one block, or one sample after another."
    )
    source = "neo-Hookean walls: Ogden (1997); tubes of several stocks: Marechal et al. (2021)"
    parameter_class = Stock
    depends_on = ("i1",)
    # The energy of which each actuator has a modulus of its own, and what the material calls that.
    energy: ClassVar[type[NeoHookean] | type[StandardFiber]] = NeoHookean
    modulus: ClassVar[str] = "C1"

    def psi(self, *invariants: Tensor, p: Stock, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        return self._more(p, material).psi(*invariants)

    def psi_gradient(self, *invariants: Tensor, p: Stock, material: Material) -> tuple[Tensor, ...]:
        """That of the energy, of what is beyond the first actuator's."""
        (slope,) = self._more(p, material).gradient(*invariants)
        return (slope.expand_as(invariants[0]),)

    def psi_hessian(self, *invariants: Tensor, p: Stock, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        _, (slope,) = self._more(p, material).gradient_rate(invariants, (torch.ones_like(invariants[0]),))
        return ((0 * invariants[0] if slope is None else slope.expand_as(invariants[0]),),)

    def closed_form(self, tube: Tube, p: Stock, material: Material) -> Wall | None:
        """The energy's."""
        return self._more(p, material).closed_form(tube)

    def _more(self, p: Stock, material: Material) -> Energy:
        """What the actuator has beyond the first one's modulus."""
        return self.energy(getattr(material, self.modulus) * torch.expm1(p.log_ratio))


class FiberModulus(WallModulus):
    """Ψ of actuator i += (C2ᵢ − C2)/2 (I₄ − 1)², C2ᵢ = C2 e^a: fibers that stiffen its wall by a share of their own.

    As wall_modulus, of the fibers: threads of several stocks, and threads that are wound more or less densely, whose
    stiffness per unit of wall C2 is.
    """

    name = "fiber_modulus"
    place = 8
    suspect = "Actuators of one drawing resist the load of their fibers more or less, each by its share."
    source = "standard fibers: Holzapfel (2000); C2 is their stiffness per unit of wall"
    depends_on = ("i4",)
    energy = StandardFiber
    modulus = "C2"
