"""Strain energies Ψ(I₁, I₂, I₄) of the wall and its fibre, and their derivatives.

An energy says which invariants it uses and gives Ψ; stresses follow by automatic differentiation. The two
energies of the paper write their derivatives by hand for speed (tests check them against the automatic ones).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

import torch
from torch import Tensor

from freelearn.mechanics.tube import Deformation

# Derivatives of Ψ with respect to the invariants it depends on, by name: {"i1": Ψ₁, "i2": Ψ₂, "i4": Ψ₄} [Pa].
Gradient = dict[str, Tensor]


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

    def gradient_rate(self, at: Deformation) -> tuple[Gradient, Gradient]:
        """The gradient and its derivative with respect to u = r_i²."""
        total: Gradient = {}
        rate: Gradient = {}
        for term in self.terms:
            invariants = tuple(getattr(at, name) for name in term.depends_on)
            rates = tuple(at.rate(name) for name in term.depends_on)
            values, value_rates = term.gradient_rate(invariants, rates)
            _accumulate(total, term.depends_on, values)
            _accumulate(rate, term.depends_on, value_rates)
        return total, rate


def _accumulate(total: Gradient, names: tuple[str, ...], values: tuple[Tensor | None, ...]) -> None:
    for name, value in zip(names, values, strict=True):
        if value is not None:
            total[name] = total[name] + value if name in total else value
