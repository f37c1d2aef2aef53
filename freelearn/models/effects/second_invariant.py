"""Rubber whose resistance to shear and to stretch differ."""

from collections.abc import Mapping
from types import SimpleNamespace

import torch
from torch import Tensor

from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class SecondInvariant(Effect):
    """ΔΨ = C01/2 (I₂ − 3), the second term of Mooney-Rivlin; the wall's shear modulus is then C1 + C01."""

    name = "second_invariant"
    suspect = "The wall is right in tension but wrong in twist or compression: a neo-Hookean solid is too simple."
    source = "Mooney (1940); Rivlin (1948)"
    models = ("continuum",)
    parameters = (Parameter("C01", "C₀₁", "Pa", start=2e4, lower=0.0, none=0.0, scale=1e5),)
    depends_on = ("i2",)

    def psi(self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]) -> Tensor:
        return p.C01 / 2 * (invariants[0] - 3)

    def psi_gradient(
        self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]
    ) -> tuple[Tensor, ...]:
        return ((p.C01 / 2).expand_as(invariants[0]),)

    def psi_hessian(
        self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]
    ) -> tuple[tuple[Tensor, ...], ...]:
        return ((torch.zeros_like(p.C01),),)
