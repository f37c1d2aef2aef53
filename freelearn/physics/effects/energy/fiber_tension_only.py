"""Fiber that buckles: threads carry tension, and only part of the compression."""

import torch
from torch import Tensor

from freelearn.physics.chain.material import Material
from freelearn.physics.chain.parameters import Parameters, Prior, parameter
from freelearn.physics.chain.ports import EnergyEffect


class Slack(Parameters):
    """share: of the compressive stress that is lost."""

    share: Tensor = parameter(
        "s",
        "1",
        start=0.5,
        lower=0.0,
        upper=1.0,
        none=0.0,
        scale=0.5,
        prior=Prior(0.0, 1.0, "threads buckle wholly, cast-in fibers not at all"),
    )


class FiberTensionOnly(EnergyEffect[Slack]):
    """ΔΨ = −s C2/2 (I₄ − 1)² where I₄ < 1: a share s of the fiber's compressive stress is lost."""

    name = "fiber_tension_only"
    place = 5
    suspect = "The model is too stiff where the fibers are shortened: threads buckle and carry no compression."
    source = "Holzapfel, Gasser & Ogden (2000) switch fibers off in compression (s = 1)"
    parameter_class = Slack
    depends_on = ("i4",)

    def psi(self, *invariants: Tensor, p: Slack, material: Material) -> Tensor:
        """As EnergyEffect.psi."""
        slack = torch.clamp(1 - invariants[0], min=0)
        return -p.share * material.C2 / 2 * slack**2

    def psi_gradient(self, *invariants: Tensor, p: Slack, material: Material) -> tuple[Tensor, ...]:
        """As EnergyEffect.psi_gradient."""
        return (p.share * material.C2 * torch.clamp(1 - invariants[0], min=0),)

    def psi_hessian(self, *invariants: Tensor, p: Slack, material: Material) -> tuple[tuple[Tensor, ...], ...]:
        """As EnergyEffect.psi_hessian."""
        return ((-p.share * material.C2 * (invariants[0] < 1),),)
