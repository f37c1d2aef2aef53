"""Integrals through the wall of a tube by Gauss-Legendre quadrature, for an energy of any form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import torch
from torch import Tensor

from freelearn.physics.mechanics.layers import Deformation, Layers
from freelearn.physics.mechanics.wall import Carried, Expansion, Resultants


class Term(Protocol):
    """What the quadrature asks of an energy (see energy.Energy)."""

    @property
    def depends_on(self) -> tuple[str, ...]:
        """The names of its invariants: i1, i2, i4."""

    @property
    def idle(self) -> bool:
        """Whether it is known to be zero everywhere."""

    def gradient(self, *invariants: Tensor) -> tuple[Tensor, ...]:
        """∂Ψ/∂I [Pa] for each of them."""

    def gradient_rate(
        self, invariants: tuple[Tensor, ...], rates: tuple[Tensor, ...]
    ) -> tuple[tuple[Tensor, ...], tuple[Tensor | None, ...]]:
        """The gradient and its derivative along `rates`, None where that is zero."""

    def detach(self) -> Term:
        """The same energy with its parameters cut from every derivative."""

    def some(self, rows: Tensor, count: int) -> Term:
        """The same energy in some of so many tubes; rows: (n,) int64."""


class QuadratureWall:
    """A Wall for energies of any form (see wall.Wall): stresses at Q radii, summed."""

    def __init__(self, terms: Sequence[Term], layers: Layers) -> None:
        self.terms, self.layers = terms, layers

    def detach(self) -> QuadratureWall:
        """The same wall, cut from every derivative."""
        return QuadratureWall([term.detach() for term in self.terms], self.layers.detach())

    def some(self, rows: Tensor, count: int) -> QuadratureWall:
        """The walls of some of so many tubes."""
        return QuadratureWall([term.some(rows, count) for term in self.terms], self.layers.some(rows, count))

    def carried(self, u: Tensor) -> Carried:
        """Term by term (σθθ − σrr)/(2r²) = Ψᵢ ∂Iᵢ/∂u: the pressure's work is the change of the energy."""
        at = Deformation(self.layers, u)
        value, slope = torch.zeros_like(at.r2), torch.zeros_like(at.r2)
        for term in self.terms:
            rates = tuple(at.rate(name) for name in term.depends_on)
            values, value_rates = term.gradient_rate(at.invariants(term.depends_on), rates)
            for name, psi, psi_rate, share in zip(term.depends_on, values, value_rates, rates, strict=True):
                value = value + psi * share
                if psi_rate is not None:
                    slope = slope + psi_rate * share
                if name != "i4":  # I₄ is linear in u
                    slope = slope + psi * at.curvature(name)
        return Carried((self.layers.weight * value).sum(-2), (self.layers.weight * slope).sum(-2))

    @property
    def stiffens(self) -> bool:
        """An energy of any form may soften, unless it is idle.

        A wall with idle terms is then solved just as one without them, to the last bit.
        """
        return all(term.idle for term in self.terms)

    def expansion(self, u: Tensor) -> Expansion:
        """Zero, that of idle terms."""
        zero = torch.zeros_like(u)
        return Expansion(zero, zero, zero)

    def resultants(self, u: Tensor) -> Resultants:
        """σ = 2Ψ₁B + 2Ψ₂(I₁B − B²) + 2Ψ₄ a⊗a, without the Lagrange multiplier."""
        at, wall = Deformation(self.layers, u), self.layers
        gradient = self._gradient(at)
        tension: Tensor | float = 0.0  # (2σzz − σrr − σθθ)/2
        shear: Tensor | float = 0.0  # σθz r/2
        swirl = at.r2 * (wall.twist_rate * wall.axial)  # B_θz r
        if "i1" in gradient:
            tension = gradient["i1"] * (2 * wall.axial2 - at.b_rr - at.b_thetatheta)
            shear = gradient["i1"] * swirl
        if "i2" in gradient:
            # The diagonal of I₁B − B², simplified with det B = 1 in the (θ, z) block.
            rr = at.b_rr * (at.b_thetatheta + wall.axial2)
            thetatheta = at.b_rr * at.b_thetatheta + 1 / at.b_rr
            zz = at.b_rr * wall.axial2 + 1 / at.b_rr
            tension = tension + gradient["i2"] * (2 * zz - rr - thetatheta)
            shear = shear + gradient["i2"] * (at.b_rr * swirl)
        if "i4" in gradient:
            tension = tension + gradient["i4"] * (2 * wall.fiber_axial2 - at.r2 * wall.fiber_hoop2)
            shear = shear + gradient["i4"] * (at.r2 * wall.fiber_hoop * wall.fiber_axial)
        return Resultants((wall.weight * tension).sum(-2), (wall.weight * shear).sum(-2))

    def _gradient(self, at: Deformation) -> dict[str, Tensor]:
        """∂Ψ/∂I of all terms together [Pa], by the invariant's name."""
        total: dict[str, Tensor] = {}
        for term in self.terms:
            values = term.gradient(*at.invariants(term.depends_on))
            for name, value in zip(term.depends_on, values, strict=True):
                total[name] = total[name] + value if name in total else value
        return total
