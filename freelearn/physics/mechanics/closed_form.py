"""The walls of the paper's two energies, integrated through the thickness in closed form.

With r² = x + a², x = u − R_i²/λz (see tube.Tube), every stress of the standard fiber is a polynomial in x whose
coefficients are integrals ∫ aⁿ da, and those of the neo-Hookean wall add one logarithm (Ogden 1997, Section 5.3.3).
No quadrature, so no error of one, and no work per point. Tests hold both against the quadrature and the textbook.

What is proportional to the modulus stands in the rows of one tensor: of few tubes each operation costs the same,
whatever it is done to, and a search evaluates few tubes a great many times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import torch
from torch import Tensor, addcmul

from freelearn.common.some_rows import InRows
from freelearn.physics.mechanics.tube import LEAST, Tube
from freelearn.physics.mechanics.wall import Carried, Expansion, Resultants

T = TypeVar("T", bound="_ClosedForm")
# The highest power of a fiber's double stretch g in the stresses.
HIGHEST = 4


class Rates(NamedTuple):
    """∂tension/∂u [N/m²] and ∂shear/∂u [N/m] of Resultants, both (N,)."""

    tension: Tensor
    shear: Tensor


@dataclass(frozen=True)
class _ClosedForm(InRows):
    """rest: R_i²/λz, (N,) m². terms: what is proportional to the modulus, (terms, N), in SI."""

    rest: Tensor
    terms: Tensor
    stiffens = True

    def scaled(self: T, modulus: Tensor) -> T:
        """The wall with its modulus, () or (N,), times as large."""
        return replace(self, terms=modulus * self.terms)

    def detach(self: T) -> T:
        """The same wall, cut from every derivative."""
        own: dict[str, Any] = {f.name: getattr(self, f.name).detach() for f in fields(self)}
        return replace(self, **own)

    @cached_property
    def each(self) -> tuple[Tensor, ...]:
        """The terms, (N,) each."""
        return self.terms.unbind()


@dataclass(frozen=True)
class NeoHookeanWall(_ClosedForm):
    """Ψ = C1/2 (I₁ − 3) in the wall.

    With s = (R_o² − R_i²)/λz, ρ = u/(u + s) = r_i²/r_o², ξ = x/u and H = ∫ (1/R² + k²) a da:
    P = C1 H + C1/(2λz) (ln ρ + ξ (1 − ρ)),
    tension = C1 [2 (λz² − 1/λz) ∫ a da − k² ∫ a³ da − x (H + ln ρ/(2λz))],
    shear = C1 k λz [x ∫ a da + ∫ a³ da].

    solid: s, (N,) m². terms: half C1/(2λz) [Pa], hoop C1 H [Pa], what of the tension is free of x [N], coefficients of
    1 and x of the shear [N·m, N/m].
    """

    solid: Tensor

    @classmethod
    def from_tube(cls, tube: Tube) -> NeoHookeanWall:
        """The wall of C1 = 1 Pa."""
        log, second, fourth = (tube.integral(n) for n in (-1, 1, 3))
        inverse, k, axial = torch.reciprocal(tube.axial), tube.twist_rate, tube.axial
        k2, turned = k * k, k * axial
        stretch = addcmul(inverse, axial, axial, value=-1.0)
        hoop = addcmul(inverse * log, k2, second)
        tension = -addcmul(k2 * fourth, stretch, second, value=2.0)
        terms = torch.stack([0.5 * inverse, hoop, tension, turned * fourth, turned * second])
        return cls(tube.unloaded_u, terms, tube.solid)

    def carried(self, u: Tensor) -> Carried:
        """See wall.Wall. u dP/du = C1/(2λz) (1 − ρ) (2 − ξ (1 + ρ))."""
        half, hoop, *_ = self.each
        ratio, part = u / (u + self.solid), (u - self.rest) / u
        thinner = 1.0 - ratio
        pressure = addcmul(hoop, half, addcmul(ratio.log(), part, thinner))
        return Carried(pressure, (half * thinner / u) * (2.0 - part * (1.0 + ratio)))

    def expansion(self, u: Tensor) -> Expansion:
        """See wall.Wall. u² d²P/du² = −C1/(2λz) (1 − ρ) (3 (1 + ρ) − 2 ξ (1 + ρ + ρ²))."""
        half, hoop, *_ = self.each
        ratio, part = u / (u + self.solid), (u - self.rest) / u
        thinner, outer = 1.0 - ratio, 1.0 + ratio
        pressure = addcmul(hoop, half, addcmul(ratio.log(), part, thinner))
        weight = half * thinner
        bend = addcmul(-3.0 * outer, part, addcmul(outer, ratio, ratio), value=2.0)
        return Expansion(pressure, weight * (2.0 - part * outer), weight * bend)

    def resultants(self, u: Tensor) -> Resultants:
        """See wall.Wall."""
        half, hoop, tension, once, turned = self.each
        x = u - self.rest
        around = addcmul(hoop, half, (u / (u + self.solid)).log())
        return Resultants(addcmul(tension, x, around, value=-1.0), addcmul(once, x, turned))

    def rates(self, u: Tensor) -> Rates:
        """∂resultants/∂u: the tension falls with u by the pressure carried."""
        return Rates(-self.carried(u).pressure, self.each[-1])


@dataclass(frozen=True)
class FiberWall(_ClosedForm):
    """Ψ = C2/2 (I₄ − 1)² in the wall: polynomials in x, since I₄ − 1 = (x + a²) g² + e, e = λz² cos² Γ − 1.

    terms: coefficients of 1, x of the pressure, of 1, x, x² of the tension and of the shear.
    """

    @classmethod
    def from_tube(cls, tube: Tube) -> FiberWall:
        """The wall of C2 = 1 Pa, with all of its families: polynomials in the same x, whose coefficients add up."""
        angles = [(family.sine, family.cosine) for family in tube.families]
        sine, cosine = (torch.stack(each) for each in zip(*angles, strict=True))
        axial = tube.axial * cosine
        axial2 = axial * axial
        e, cross = axial2 - 1.0, axial2 + 1.0  # 2 λz² cos² Γ − e
        g = _double_stretch_moments(tube.integrals, sine, tube.twist_rate * cosine)
        fixed = addcmul(cross * g[2, 1], axial2 * e, tube.integral(1), value=2.0) - g[4, 2]
        terms = torch.stack([
            addcmul(g[4, 1], e, g[2, 0]),
            g[4, 0],
            fixed,
            torch.sub(cross * g[2, 0], g[4, 1], alpha=2.0),
            -g[4, 0],
            axial * addcmul(g[3, 2], e, g[1, 1]),
            axial * addcmul(2.0 * g[3, 1], e, g[1, 0]),
            axial * g[3, 0],
        ])  # fmt: skip
        first, *others = (2.0 * terms).unbind(1)
        for family, other in zip(tube.families[1:], others, strict=True):
            first = first + (other if family.share is None else family.share * other)
        return cls(tube.unloaded_u, first)

    def carried(self, u: Tensor) -> Carried:
        """See wall.Wall."""
        start, slope, *_ = self.each
        return Carried(addcmul(start, slope, u - self.rest), slope)

    def expansion(self, u: Tensor) -> Expansion:
        """See wall.Wall."""
        start, slope, *_ = self.each
        return Expansion(addcmul(start, slope, u - self.rest), slope * u, u.new_zeros(()))

    def resultants(self, u: Tensor) -> Resultants:
        """See wall.Wall."""
        x, (_, _, *rest) = u - self.rest, self.each
        return Resultants(_quadratic(rest[:3], x), _quadratic(rest[3:], x))

    def rates(self, u: Tensor) -> Rates:
        """∂resultants/∂u."""
        twice, (_, _, _, b, c, _, e, f) = 2.0 * (u - self.rest), self.each
        return Rates(addcmul(b, c, twice), addcmul(e, f, twice))


def _quadratic(coefficients: Sequence[Tensor], x: Tensor) -> Tensor:
    return addcmul(coefficients[0], x, addcmul(coefficients[1], x, coefficients[2]))


def _double_stretch_moments(integrals: Tensor, s: Tensor, c: Tensor) -> dict[tuple[int, int], Tensor]:
    """∫ gⁿ a^(1+2j) da of each family, by (n, j): (families, N) each.

    integrals: Tube.integrals, (9, N). s = sin Γ/√λz and c = k cos Γ, (families, N), make g = sin Γ/R + k cos Γ of which
    gⁿ aⁿ = (s + c a)ⁿ: from the integrals of all powers of a those with one factor s + c a more, and so on.
    """
    rows, moments = integrals[:, None], dict[tuple[int, int], Tensor]()
    for n in range(1, HIGHEST + 1):
        rows = addcmul(s * rows[:-1], c, rows[1:])
        # The first row is of a to the power LEAST.
        for j, moment in enumerate(rows[1 - n - LEAST :: 2].unbind()):
            moments[n, j] = moment
    return moments
