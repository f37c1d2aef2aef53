"""Fibre that buckles: threads carry tension, and only part of the compression."""

from collections.abc import Mapping
from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class FiberTensionOnly(Effect):
    """ΔΨ = −s C2/2 (I₄ − 1)² where I₄ < 1: a share s of the fibre's compressive stress is lost."""

    name = "fiber_tension_only"
    suspect = "The model is too stiff where the fibres are shortened: threads buckle and carry no compression."
    source = "Holzapfel, Gasser & Ogden (2000) switch fibres off in compression (s = 1)"
    models = ("continuum",)
    parameters = (Parameter("share", "s", "1", start=0.5, lower=0.0, upper=1.0, none=0.0, scale=0.5),)
    depends_on = ("i4",)

    def psi(self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]) -> Tensor:
        slack = torch.clamp(1 - invariants[0], min=0)
        return -p.share * material["C2"] / 2 * slack**2

    def psi_gradient(
        self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]
    ) -> tuple[Tensor, ...]:
        return (p.share * material["C2"] * torch.clamp(1 - invariants[0], min=0),)

    def psi_hessian(
        self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]
    ) -> tuple[tuple[Tensor, ...], ...]:
        return ((-p.share * material["C2"] * (invariants[0] < 1),),)
