"""Strain energies Ψ(I₁, I₂, I₄), their derivatives, the walls they make, and the stress of a sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

import torch
from torch import Tensor

from freelearn.common.some_rows import InRows
from freelearn.physics.mechanics.automatic import along, gradient
from freelearn.physics.mechanics.closed_form import FiberWall, NeoHookeanWall
from freelearn.physics.mechanics.layers import Layers
from freelearn.physics.mechanics.quadrature import QuadratureWall
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.mechanics.wall import Wall, WallSum

# Strain energies Ψ(I₁, I₂, I₄) of the wall and its fiber, their derivatives, and the walls they make.
#
# An energy says which invariants it uses and gives Ψ; stresses follow by automatic differentiation and are
# integrated by quadrature. The two energies of the paper write their derivatives by hand and have their integrals
# in closed form, for speed (tests check them against the automatic ones).

Tensors = tuple[Tensor, ...]


@dataclass(frozen=True)
class Energy(InRows):
    """One term of the strain energy per reference volume, Ψ [Pa]. Fields are its parameters, as tensors."""

    depends_on: ClassVar[tuple[str, ...]] = ("i1", "i2", "i4")
    # Whether it acts at the bore alone: Ψ and its derivatives are then per area of the bore at rest, in N/m.
    at_bore: ClassVar[bool] = False

    def psi(self, *invariants: Tensor) -> Tensor:
        """Ψ at the invariants named in `depends_on`, each (Q, N) → (Q, N) Pa."""
        raise NotImplementedError

    def gradient(self, *invariants: Tensor) -> Tensors:
        """∂Ψ/∂I [Pa] for each invariant in `depends_on`."""

        def total(*args: Tensor) -> Tensor:
            return self.psi(*args).sum()

        return gradient(total, *invariants)

    def gradient_rate(self, invariants: Tensors, rates: Tensors) -> tuple[Tensors, tuple[Tensor | None, ...]]:
        """The gradient, and its derivative along `rates` (the invariants' own derivatives); None where it is zero."""
        return along(self.gradient, invariants, rates)

    @property
    def idle(self) -> bool:
        """Whether the parameters are known to make Ψ zero everywhere."""
        return False

    def closed_form(self, tube: Tube) -> Wall | None:
        """The wall that this term makes of N tubes, integrated exactly; None leaves it to quadrature."""
        return None

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
        """Ψ [Pa] at I₁."""
        return self.C1 / 2 * (invariants[0] - 3)

    def gradient(self, *invariants: Tensor) -> Tensors:
        """C₁/2."""
        return (self.C1 / 2,)

    def gradient_rate(self, invariants: Tensors, rates: Tensors) -> tuple[Tensors, tuple[Tensor | None, ...]]:
        """The gradient is constant."""
        return (self.C1 / 2,), (None,)

    def closed_form(self, tube: Tube) -> Wall | None:
        """See closed_form.NeoHookeanWall."""
        return tube.once(NeoHookeanWall.from_tube).scaled(self.C1)


@dataclass(frozen=True)
class StandardFiber(Energy):
    """Ψ = C₂/2 (I₄ − 1)², fiber stiffness C₂ [Pa] per unit of wall (Holzapfel 2000; Eq. standardFiber)."""

    C2: Tensor
    depends_on: ClassVar[tuple[str, ...]] = ("i4",)

    def psi(self, *invariants: Tensor) -> Tensor:
        """Ψ [Pa] at I₄."""
        return self.C2 / 2 * (invariants[0] - 1) ** 2

    def gradient(self, *invariants: Tensor) -> Tensors:
        """C₂ (I₄ − 1)."""
        return (self.C2 * (invariants[0] - 1),)

    def gradient_rate(self, invariants: Tensors, rates: Tensors) -> tuple[Tensors, tuple[Tensor | None, ...]]:
        """C₂ (I₄ − 1) and C₂ times I₄'s rate."""
        return (self.C2 * (invariants[0] - 1),), (self.C2 * rates[0],)

    def closed_form(self, tube: Tube) -> Wall | None:
        """See closed_form.FiberWall."""
        return tube.once(FiberWall.from_tube).scaled(self.C2)


@dataclass(frozen=True)
class EnergySum:
    """The wall's whole strain energy: the sum of its terms."""

    terms: Sequence[Energy]

    def wall(self, tube: Tube) -> Wall:
        """What the energy carries in N tubes: exactly where a term knows how, unless the tube asks for points.

        The other terms share one quadrature.
        """
        through = [term for term in self.terms if not term.at_bore]
        closed = [None if tube.points else term.closed_form(tube) for term in through]
        parts: list[Wall] = [wall for wall in closed if wall is not None]
        others = [term for term, wall in zip(through, closed, strict=True) if wall is None]
        if others:
            parts.append(QuadratureWall(others, tube.once(Layers.from_tube)))
        lining = [term for term in self.terms if term.at_bore]
        if lining:
            parts.append(QuadratureWall(lining, tube.once(Layers.bore)))
        # A term of the fibers counts for each family of them.
        fibers = [term for term in others if "i4" in term.depends_on]
        if fibers and tube.second is not None:
            parts.append(QuadratureWall(fibers, tube.second.once(Layers.from_tube)))
        return parts[0] if len(parts) == 1 else WallSum(parts)


@dataclass(frozen=True)
class LinearMaterial(Energy):
    """Ψ = C₁ tr E² = C₁/4 (I₁² − 2 I₂ − 2 I₁ + 3), E the Green-Lagrange strain, C₁ the shear modulus [Pa].

    Incompressible St. Venant-Kirchhoff material (Holzapfel 2000, Section 6.5): Hooke's law kept at large deformation.
    """

    C1: Tensor
    depends_on: ClassVar[tuple[str, ...]] = ("i1", "i2")

    def psi(self, *invariants: Tensor) -> Tensor:
        """Ψ [Pa] at I₁ and I₂."""
        i1, i2 = invariants
        return self.C1 / 4 * (i1 * i1 - 2 * i2 - 2 * i1 + 3)


MPA = 1e6  # Pa


def nominal_stress(terms: Sequence[Energy], along: Tensor, across: Tensor) -> Tensor:
    """Force in a direction per undeformed area: the stretches along and across it, each (N,) → (N,) Pa, + in tension.

    P₁ = 2 (λ₁ − λ₃²/λ₁) (Ψ₁ + λ₂² Ψ₂), Ψᵢ = ∂Ψ/∂Iᵢ, where λ₃ = 1/(λ₁λ₂) and the sheet's faces are free of load (Rivlin
    & Saunders 1951; Ogden 1997). λ₂ is λ₁^-½ in uniaxial and λ₁ in equibiaxial tension, 1 in pure shear.
    """
    first, second = along**2, across**2
    third = 1 / (first * second)
    at = {"i1": first + second + third, "i2": 1 / first + 1 / second + 1 / third}
    weight = {"i1": torch.ones_like(second), "i2": second}
    total = torch.zeros_like(along)
    for term in terms:
        for name, slope in zip(term.depends_on, term.gradient(*(at[n] for n in term.depends_on)), strict=True):
            total = total + weight[name] * slope
    return 2 * (along - third / along) * total
