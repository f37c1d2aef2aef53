"""Strain energies Ψ(I₁, I₂, I₄) of the wall and its fibre, and their derivatives.

An energy says which invariants it uses and gives Ψ; stresses follow by automatic differentiation. The two
energies of the paper write their derivatives, and what they carry in the hoop direction, by hand for speed (tests
check them against the automatic ones).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

import torch
from torch import Tensor

from freelearn.mechanics.tube import Deformation, Tube

# Derivatives of Ψ with respect to the invariants it depends on, by name: {"i1": Ψ₁, "i2": Ψ₂, "i4": Ψ₄} [Pa].
Gradient = dict[str, Tensor]

# From u = r_i² (N,) m² to the pressure carried, P = ∫ (σθθ − σrr)/r dr [Pa], and dP/du [Pa/m²], both (N,).
Hoop = Callable[[Tensor], tuple[Tensor, Tensor]]


@dataclass(frozen=True)
class Energy:
    """One term of the strain energy per reference volume, Ψ [Pa]. Fields are its parameters, as tensors."""

    depends_on: ClassVar[tuple[str, ...]] = ("i1", "i2", "i4")

    def psi(self, *invariants: Tensor) -> Tensor:
        """Ψ at the invariants named in `depends_on`, each (Q, N) → (Q, N) Pa."""
        raise NotImplementedError

    def gradient(self, *invariants: Tensor) -> tuple[Tensor, ...]:
        """∂Ψ/∂I for each invariant in `depends_on`."""

        def total(*args: Tensor) -> Tensor:
            return self.psi(*args).sum()

        return torch.func.grad(total, argnums=tuple(range(len(invariants))))(*invariants)

    def gradient_rate(
        self, invariants: tuple[Tensor, ...], rates: tuple[Tensor, ...]
    ) -> tuple[tuple[Tensor, ...], tuple[Tensor | None, ...]]:
        """The gradient, and its derivative along `rates` (the invariants' own derivatives); None where it is zero."""
        derivative = torch.func.jvp(self.gradient, invariants, rates)
        return derivative[0], derivative[1]

    def hoop(self, tube: Tube) -> Hoop:
        """This term's part of the pressure that the wall carries, as a function of u (see Hoop).

        Term by term (σθθ − σrr)/(2r²) = Ψᵢ ∂Iᵢ/∂u: the pressure's work is the change of the energy.
        """

        def carried(u: Tensor) -> tuple[Tensor, Tensor]:
            at = Deformation(tube, u)
            rates = tuple(at.rate(name) for name in self.depends_on)
            values, value_rates = self.gradient_rate(tuple(getattr(at, n) for n in self.depends_on), rates)
            value, slope = torch.zeros_like(at.r2), torch.zeros_like(at.r2)
            for name, psi, psi_rate, share in zip(self.depends_on, values, value_rates, rates, strict=True):
                value = value + psi * share
                if psi_rate is not None:
                    slope = slope + psi_rate * share
                if name != "i4":  # I₄ is linear in u
                    slope = slope + psi * at.curvature(name)
            return (tube.weight * value).sum(-2), (tube.weight * slope).sum(-2)

        return carried

    def detach(self) -> Energy:
        """The same energy with its parameters cut from every derivative."""
        return replace(self, **{f.name: _detached(getattr(self, f.name)) for f in fields(self)})


def _detached(value: Any) -> Any:
    return value.detach() if isinstance(value, Tensor) else value


@dataclass(frozen=True)
class NeoHookean(Energy):
    """Ψ = C₁/2 (I₁ − 3), an isotropic rubber with shear modulus C₁ [Pa] (Ogden 1997; the paper's Eq. neoHook)."""

    C1: Tensor
    depends_on: ClassVar[tuple[str, ...]] = ("i1",)

    def psi(self, *invariants: Tensor) -> Tensor:
        return self.C1 / 2 * (invariants[0] - 3)

    def gradient(self, *invariants: Tensor) -> tuple[Tensor, ...]:
        return (self.C1 / 2,)

    def gradient_rate(
        self, invariants: tuple[Tensor, ...], rates: tuple[Tensor, ...]
    ) -> tuple[tuple[Tensor, ...], tuple[Tensor | None, ...]]:
        return (self.C1 / 2,), (None,)

    def hoop(self, tube: Tube) -> Hoop:
        half, share = self.C1 / 2, tube.weight * tube.radial
        constant = (tube.weight * tube.hoop).sum(-2)

        def carried(u: Tensor) -> tuple[Tensor, Tensor]:
            inverse = torch.reciprocal(u + tube.offset)
            thinning = share * (inverse * inverse)
            return half * (constant - thinning.sum(-2)), self.C1 * (thinning * inverse).sum(-2)

        return carried


@dataclass(frozen=True)
class StandardFiber(Energy):
    """Ψ = C₂/2 (I₄ − 1)², fibre stiffness C₂ [Pa] per unit of wall (Holzapfel 2000; Eq. standardFiber)."""

    C2: Tensor
    depends_on: ClassVar[tuple[str, ...]] = ("i4",)

    def psi(self, *invariants: Tensor) -> Tensor:
        return self.C2 / 2 * (invariants[0] - 1) ** 2

    def gradient(self, *invariants: Tensor) -> tuple[Tensor, ...]:
        return (self.C2 * (invariants[0] - 1),)

    def gradient_rate(
        self, invariants: tuple[Tensor, ...], rates: tuple[Tensor, ...]
    ) -> tuple[tuple[Tensor, ...], tuple[Tensor | None, ...]]:
        return (self.C2 * (invariants[0] - 1),), (self.C2 * rates[0],)

    def hoop(self, tube: Tube) -> Hoop:
        # Linear in u, so the wall is summed over once.
        share = tube.weight * tube.fiber_hoop2
        slope = self.C2 * (share * tube.fiber_hoop2).sum(-2)
        start = self.C2 * (share * (tube.offset * tube.fiber_hoop2 + tube.fiber_axial2 - 1)).sum(-2)

        def carried(u: Tensor) -> tuple[Tensor, Tensor]:
            return start + slope * u, slope

        return carried


@dataclass(frozen=True)
class EnergySum:
    """The wall's whole strain energy: the sum of its terms."""

    terms: Sequence[Energy]

    def detach(self) -> EnergySum:
        return EnergySum([term.detach() for term in self.terms])

    def gradient(self, at: Deformation) -> Gradient:
        total: Gradient = {}
        for term in self.terms:
            values = term.gradient(*(getattr(at, name) for name in term.depends_on))
            _accumulate(total, term.depends_on, values)
        return total

    def hoop(self, tube: Tube) -> Hoop:
        """Pressure that the whole wall carries, and its slope, as a function of u (see Hoop)."""
        parts = [term.hoop(tube) for term in self.terms]

        def carried(u: Tensor) -> tuple[Tensor, Tensor]:
            pressures, slopes = zip(*(part(u) for part in parts), strict=True)
            return sum(pressures[1:], start=pressures[0]), sum(slopes[1:], start=slopes[0])

        return carried


def _accumulate(total: Gradient, names: tuple[str, ...], values: tuple[Tensor, ...]) -> None:
    for name, value in zip(names, values, strict=True):
        total[name] = total[name] + value if name in total else value
