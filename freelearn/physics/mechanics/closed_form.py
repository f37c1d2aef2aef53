"""The walls of the paper's two energies, integrated through the thickness in closed form.

With r² = x + a², x = u − R_i²/λz (see tube.Tube), every stress of the standard fiber is a polynomial in x whose
coefficients are integrals ∫ aⁿ da, and those of the neo-Hookean wall add one logarithm (Ogden 1997, Section 5.3.3).
No quadrature, so no error of one, and no work per point. Tests hold both against the quadrature and the textbook.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import NamedTuple

import torch
from torch import Tensor, addcmul

from freelearn.common.some_rows import InRows
from freelearn.physics.mechanics.tube import FACTORS, Tube
from freelearn.physics.mechanics.wall import Carried, Expansion, Resultants


class Rates(NamedTuple):
    """∂tension/∂u [N/m²] and ∂shear/∂u [N/m] of Resultants, both (N,)."""

    tension: Tensor
    shear: Tensor


@dataclass(frozen=True)
class NeoHookeanWall(InRows):
    """Ψ = C1/2 (I₁ − 3) in the wall.

    With s = (R_o² − R_i²)/λz, ρ = u/(u + s) = r_i²/r_o², ξ = x/u and H = ∫ (1/R² + k²) a da:
    P = C1 H + C1/(2λz) (ln ρ + ξ (1 − ρ)),
    tension = C1 [2 (λz² − 1/λz) ∫ a da − k² ∫ a³ da − x (H + ln ρ/(2λz))],
    shear = C1 k λz [x ∫ a da + ∫ a³ da].

    (N,) tensors: half C1/(2λz) [Pa]; solid s and rest R_i²/λz [m²]; hoop C1 H [Pa]; tension, what is free of x [N];
    shear, coefficients of 1 and x [N·m, N/m].
    """

    half: Tensor
    solid: Tensor
    rest: Tensor
    hoop: Tensor
    tension: Tensor
    shear: tuple[Tensor, Tensor]
    stiffens = True

    @classmethod
    def from_tube(cls, tube: Tube) -> NeoHookeanWall:
        """The wall of C1 = 1 Pa."""
        log, second, fourth = tube.powers[-1], tube.powers[1], tube.powers[3]
        inverse, k, axial = torch.reciprocal(tube.axial), tube.twist_rate, tube.axial
        k2, turned = k * k, k * axial
        stretch = addcmul(inverse, axial, axial, value=-1.0)
        return cls(
            half=0.5 * inverse,
            solid=second,
            rest=tube.unloaded_u,
            hoop=addcmul(inverse * log, k2, second, value=0.5),
            tension=-addcmul(stretch * second, k2, fourth, value=0.25),
            shear=(0.25 * turned * fourth, 0.5 * turned * second),
        )

    def scaled(self, modulus: Tensor) -> NeoHookeanWall:
        """The wall with its modulus, () or (N,), times as large."""
        once, turned = self.shear
        return NeoHookeanWall(
            modulus * self.half,
            self.solid,
            self.rest,
            modulus * self.hoop,
            modulus * self.tension,
            (modulus * once, modulus * turned),
        )

    def detach(self) -> NeoHookeanWall:
        """The same wall, cut from every derivative."""
        once, turned = self.shear
        return NeoHookeanWall(
            self.half.detach(),
            self.solid.detach(),
            self.rest.detach(),
            self.hoop.detach(),
            self.tension.detach(),
            (once.detach(), turned.detach()),
        )

    def carried(self, u: Tensor) -> Carried:
        """See wall.Wall. u dP/du = C1/(2λz) (1 − ρ) (2 − ξ (1 + ρ))."""
        ratio, part = u / (u + self.solid), (u - self.rest) / u
        thinner = 1.0 - ratio
        pressure = addcmul(self.hoop, self.half, addcmul(ratio.log(), part, thinner))
        return Carried(pressure, (self.half * thinner / u) * (2.0 - part * (1.0 + ratio)))

    def expansion(self, u: Tensor) -> Expansion:
        """See wall.Wall. u² d²P/du² = −C1/(2λz) (1 − ρ) (3 (1 + ρ) − 2 ξ (1 + ρ + ρ²))."""
        ratio, part = u / (u + self.solid), (u - self.rest) / u
        thinner, outer = 1.0 - ratio, 1.0 + ratio
        pressure = addcmul(self.hoop, self.half, addcmul(ratio.log(), part, thinner))
        weight = self.half * thinner
        bend = addcmul(-3.0 * outer, part, addcmul(outer, ratio, ratio), value=2.0)
        return Expansion(pressure, weight * (2.0 - part * outer), weight * bend)

    def resultants(self, u: Tensor) -> Resultants:
        """See wall.Wall."""
        x = u - self.rest
        hoop = addcmul(self.hoop, self.half, (u / (u + self.solid)).log())
        return Resultants(addcmul(self.tension, x, hoop, value=-1.0), addcmul(self.shear[0], x, self.shear[1]))

    def rates(self, u: Tensor) -> Rates:
        """∂resultants/∂u: the tension falls with u by the pressure carried."""
        return Rates(-self.carried(u).pressure, self.shear[1])


@dataclass(frozen=True)
class FiberWall(InRows):
    """Ψ = C2/2 (I₄ − 1)² in the wall: polynomials in x, since I₄ − 1 = (x + a²) g² + e, e = λz² cos² Γ − 1.

    rest: R_i²/λz, (N,) m². pressure, tension, shear: coefficients of 1, x (and x²), (N,) each, in SI.
    """

    rest: Tensor
    pressure: tuple[Tensor, ...]
    tension: tuple[Tensor, ...]
    shear: tuple[Tensor, ...]
    stiffens = True

    @classmethod
    def from_tube(cls, tube: Tube) -> FiberWall:
        """The wall of C2 = 1 Pa, with all of its families."""
        first, *others = (cls._family(family) for family in tube.families)
        for other in others:
            first = first.joined(other)
        return first

    def joined(self, other: FiberWall) -> FiberWall:
        """The fibers of both: polynomials in the same x, whose coefficients add up."""
        pairs = ((self.pressure, other.pressure), (self.tension, other.tension), (self.shear, other.shear))
        return FiberWall(self.rest, *(tuple(a + b for a, b in zip(*pair, strict=True)) for pair in pairs))

    @classmethod
    def _family(cls, tube: Tube) -> FiberWall:
        """One family alone."""
        axial = tube.axial * tube.cosine
        axial2 = axial * axial
        e, cross = axial2 - 1.0, axial2 + 1.0  # 2 λz² cos² Γ − e
        g = _DoubleStretchMoments(tube)
        bent, curved, stretched = g(4, 1), g(4, 0), g(2, 0)
        fixed = addcmul(cross * g(2, 1), axial2 * e, tube.powers[1], value=2.0) - g(4, 2)
        pressure = (addcmul(bent, e, stretched), curved)
        tension = (fixed, torch.sub(cross * stretched, bent, alpha=2.0), -curved)
        shear = (
            axial * addcmul(g(3, 2), e, g(1, 1)),
            axial * addcmul(2.0 * g(3, 1), e, g(1, 0)),
            axial * g(3, 0),
        )
        wall = cls(tube.unloaded_u, pressure, tension, shear)
        return wall if tube.share is None else wall.scaled(tube.share)

    def scaled(self, modulus: Tensor) -> FiberWall:
        """The wall with its modulus, () or (N,), times as large."""
        parts = (tuple(modulus * t for t in part) for part in (self.pressure, self.tension, self.shear))
        return FiberWall(self.rest, *parts)

    def detach(self) -> FiberWall:
        """The same wall, cut from every derivative."""
        parts = (tuple(t.detach() for t in part) for part in (self.pressure, self.tension, self.shear))
        return FiberWall(self.rest.detach(), *parts)

    def carried(self, u: Tensor) -> Carried:
        """See wall.Wall."""
        start, slope = self.pressure
        return Carried(addcmul(start, slope, u - self.rest), slope)

    def expansion(self, u: Tensor) -> Expansion:
        """See wall.Wall."""
        start, slope = self.pressure
        return Expansion(addcmul(start, slope, u - self.rest), slope * u, u.new_zeros(()))

    def resultants(self, u: Tensor) -> Resultants:
        """See wall.Wall."""
        x = u - self.rest
        return Resultants(_quadratic(self.tension, x), _quadratic(self.shear, x))

    def rates(self, u: Tensor) -> Rates:
        """∂resultants/∂u."""
        twice = 2.0 * (u - self.rest)
        return Rates(*(addcmul(c[1], c[2], twice) for c in (self.tension, self.shear)))


def _quadratic(coefficients: tuple[Tensor, ...], x: Tensor) -> Tensor:
    return addcmul(coefficients[0], x, addcmul(coefficients[1], x, coefficients[2]))


class _DoubleStretchMoments:
    """2 ∫ gⁿ a^(1+2j) da with g = sin Γ/R + k cos Γ, called with (n, j): (N,).

    gⁿ aⁿ = (sin Γ/√λz + k cos Γ a)ⁿ, a binomial sum over the wall's powers.
    """

    def __init__(self, tube: Tube) -> None:
        s, c = tube.sine, tube.fiber_turn
        self.powers = tube.powers
        s2, sc, c2 = s * s, s * c, c * c
        # sⁿ⁻ⁱ cⁱ
        self.products = {
            1: (s, c),
            2: (s2, sc, c2),
            3: (s2 * s, s2 * c, c2 * s, c2 * c),
            4: (s2 * s2, s2 * sc, sc * sc, sc * c2, c2 * c2),
        }
        self.zero = s.new_zeros(())

    def __call__(self, n: int, j: int) -> Tensor:
        total = self.zero
        for i, product in enumerate(self.products[n]):
            power = 1 - n + 2 * j + i
            total = addcmul(total, product, self.powers[power], value=2 * comb(n, i) * FACTORS[power])
        return total
