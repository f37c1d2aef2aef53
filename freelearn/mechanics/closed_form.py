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

from freelearn.mechanics.tube import POWERS, Tube
from freelearn.mechanics.wall import Carried, Expansion, Resultants

# Place of ∫ da among the moments.
_0 = POWERS.index(0)


class Rates(NamedTuple):
    """∂tension/∂u [N/m²] and ∂shear/∂u [N/m] of Resultants, both (N,)."""

    tension: Tensor
    shear: Tensor


@dataclass(frozen=True)
class NeoHookeanWall:
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

    @classmethod
    def of(cls, tube: Tube, modulus: Tensor) -> NeoHookeanWall:
        """The wall of shear modulus C1 [Pa], () or (N,)."""
        log, first, third = tube.moments[_0 - 1], tube.moments[_0 + 1], tube.moments[_0 + 3]
        inverse, k, modulus2 = torch.reciprocal(tube.axial), tube.twist_rate, 2.0 * modulus
        half = (0.5 * modulus) * inverse
        twist = modulus * k
        twist2, turned = twist * k, twist * tube.axial
        stretch = addcmul(inverse, tube.axial, tube.axial, value=-1.0) * modulus2
        return cls(
            half=half,
            solid=tube.solid,
            rest=tube.unloaded_u,
            hoop=addcmul(twist2 * first, half, log, value=2.0),
            tension=-addcmul(twist2 * third, stretch, first),
            shear=(turned * third, turned * first),
        )

    def detach(self) -> NeoHookeanWall:
        """The same wall, cut from every derivative."""
        whole = (self.half, self.solid, self.rest, self.hoop, self.tension)
        return NeoHookeanWall(*(t.detach() for t in whole), shear=(self.shear[0].detach(), self.shear[1].detach()))

    def carried(self, u: Tensor) -> Carried:
        """See wall.Wall. u dP/du = C1/(2λz) (1 − ρ) (2 − ξ (1 + ρ))."""
        ratio, part = u / (u + self.solid), (u - self.rest) / u
        thinner = 1.0 - ratio
        pressure = addcmul(self.hoop, self.half, addcmul(ratio.log(), part, thinner))
        return Carried(pressure, (self.half * thinner / u) * (2.0 - part * (1.0 + ratio)))

    def expansion(self, u: Tensor) -> Expansion | None:
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
class FiberWall:
    """Ψ = C2/2 (I₄ − 1)² in the wall: polynomials in x, since I₄ − 1 = (x + a²) g² + e, e = λz² cos² Γ − 1.

    rest: R_i²/λz, (N,) m². pressure, tension, shear: coefficients of 1, x (and x²), (N,) each, in SI.
    """

    rest: Tensor
    pressure: tuple[Tensor, ...]
    tension: tuple[Tensor, ...]
    shear: tuple[Tensor, ...]

    @classmethod
    def of(cls, tube: Tube, stiffness: Tensor) -> FiberWall:
        """The wall of fiber stiffness C2 [Pa], () or (N,)."""
        axial = tube.axial * tube.cosine
        axial2 = axial * axial
        e, cross = axial2 - 1.0, axial2 + 1.0  # 2 λz² cos² Γ − e
        double = 2.0 * stiffness
        moments = double * tube.moments
        one, two = _stretch_moments(tube, moments, 1, 2), _stretch_moments(tube, moments, 2, 2)
        three, four = _stretch_moments(tube, moments, 3, 3), _stretch_moments(tube, moments, 4, 3)
        fixed = addcmul(cross * two[1], axial2 * e, moments[_0 + 1], value=2.0) - four[2]
        shear = axial * torch.stack([addcmul(three[2], e, one[1]), addcmul(2.0 * three[1], e, one[0]), three[0]])
        return cls(
            rest=tube.unloaded_u,
            pressure=(addcmul(four[1], e, two[0]), four[0]),
            tension=(fixed, addcmul(cross * two[0], four[1], four.new_tensor(-2.0)), -four[0]),
            shear=shear.unbind(0),
        )

    def detach(self) -> FiberWall:
        """The same wall, cut from every derivative."""
        parts = (tuple(t.detach() for t in part) for part in (self.pressure, self.tension, self.shear))
        return FiberWall(self.rest.detach(), *parts)

    def carried(self, u: Tensor) -> Carried:
        """See wall.Wall."""
        start, slope = self.pressure
        return Carried(addcmul(start, slope, u - self.rest), slope)

    def expansion(self, u: Tensor) -> Expansion | None:
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


def _stretch_moments(tube: Tube, moments: Tensor, power: int, count: int) -> Tensor:
    """∫ gⁿ a^(1+2j) da for j = 0 … count − 1, n = power, g = sin Γ/R + k cos Γ: (count, N).

    gⁿ aⁿ = (sin Γ/√λz + k cos Γ a)ⁿ by Horner's rule, all j side by side.
    """
    s, c = tube.sine, tube.fiber_turn
    total = moments[_0 + 1 : _0 + 2 * count : 2]
    weight = s
    for i in range(1, power + 1):
        if i > 1:
            weight = weight * s
        place, choose = _0 + 1 - i, comb(power, i)
        part = moments[place : place + 2 * count - 1 : 2]
        total = addcmul(c * total, weight, part, value=float(choose))
    return total
