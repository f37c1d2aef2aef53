"""Rubber that stiffens at large stretch."""

from collections.abc import Mapping
from types import SimpleNamespace

from torch import Tensor

from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect


class WallStiffening(Effect):
    """ΔΨ = C20 (I₁ − 3)², the second term of Yeoh's energy (Yeoh 1993)."""

    name = "wall_stiffening"
    suspect = "The loads fall short at large stretch and twist although they are right near the reference state."
    source = "Yeoh (1993)"
    models = ("continuum",)
    parameters = (Parameter("C20", "C₂₀", "Pa", start=1e4, lower=0.0, none=0.0, scale=3e5),)
    depends_on = ("i1",)

    def psi(self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]) -> Tensor:
        return p.C20 * (invariants[0] - 3) ** 2

    def psi_gradient(
        self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]
    ) -> tuple[Tensor, ...]:
        return (2 * p.C20 * (invariants[0] - 3),)

    def psi_hessian(
        self, *invariants: Tensor, p: SimpleNamespace, material: Mapping[str, Tensor]
    ) -> tuple[tuple[Tensor, ...], ...]:
        return ((2 * p.C20,),)
