"""The paper's two physics models, one row at a time, straight from the equations: slow, and not clever.

Nothing here is shared with the package. The wall is followed in the current configuration, the radius comes
from SciPy's brentq, every integral from SciPy's quad, and the Lagrange multiplier b(r) is computed and used.
SI units.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

# A float, or an array or a complex number of some.
Number = Any
# ∂Ψ/∂I [Pa] as a function of (I1, I2, I4).
Slope = Callable[[Number, Number, Number], Number]

# A floor as well as a relative bound: an integral that is zero (a tube at rest) never meets the relative one.
PASCAL = {"epsabs": 1e-8, "epsrel": 1e-11, "limit": 200}
NEWTON = {"epsabs": 1e-12, "epsrel": 1e-10}
NEWTON_METRE = {"epsabs": 1e-15, "epsrel": 1e-11, "limit": 200}
BALLOON = 2.5


class Row:
    """One tube at length l and twist φ; psi1, psi2, psi4: ∂Ψ/∂I [Pa] as functions of (I1, I2, I4).

    second: angle of a second family of fibers, which adds psi4 of its own I4; psi1 and psi2 then must not depend on I4.
    """

    def __init__(
        self,
        gamma: Number,
        L: Number,
        Ri: Number,
        Ro: Number,
        length: Number,
        phi: Number,
        psi1: Slope,
        psi2: Slope,
        psi4: Slope,
        second: Number = None,
    ) -> None:
        self.families = [gamma] if second is None else [gamma, second]
        self.gamma, self.L, self.Ri, self.Ro, self.length, self.phi = gamma, L, Ri, Ro, length, phi
        self.psi = psi1, psi2, psi4
        self.stretch = length / L

    def outer(self, ri: Number) -> Number:
        """r_o² = r_i² + (R_o² − R_i²)/λz [m]: the wall keeps its volume."""
        return math.sqrt(ri**2 + (self.Ro**2 - self.Ri**2) / self.stretch)

    def extra_stress(self, r: Number, ri: Number) -> Number:
        """σ + b I = 2Ψ₁ B + 2Ψ₂ (I₁B − B²) + 2Ψ₄ a⊗a at current radius r: (3, 3) Pa in (r, θ, z)."""
        R = math.sqrt(self.Ri**2 + self.stretch * (r**2 - ri**2))
        F = np.diag([R / (r * self.stretch), r / R, self.stretch])
        F[1, 2] = r * self.phi / self.L  # the paper prints Φ/L; the twist φ is meant
        B = F @ F.T
        i1 = np.trace(B)
        i2 = (i1**2 - np.trace(B @ B)) / 2
        fibers = [F @ np.array([0, math.sin(gamma), math.cos(gamma)]) for gamma in self.families]
        psi1, psi2 = (psi(i1, i2, fibers[0] @ fibers[0]) for psi in self.psi[:2])
        stress = 2 * psi1 * B + 2 * psi2 * (i1 * B - B @ B)
        for a in fibers:
            stress = stress + 2 * self.psi[2](i1, i2, a @ a) * np.outer(a, a)
        return stress

    def pressure(self, ri: Number) -> Number:
        """P = ∫ (σθθ − σrr)/r dr over the current wall."""

        def integrand(r: Number) -> Number:
            s = self.extra_stress(r, ri)
            return (s[1, 1] - s[0, 0]) / r

        return quad(integrand, ri, self.outer(ri), **PASCAL)[0]

    def radial_stress(self, r: Number, ri: Number) -> Number:
        """σrr(r) = −∫_r^{r_o} (σθθ − σrr)/r dr, from dσrr/dr = (σθθ − σrr)/r and σrr(r_o) = 0."""

        def integrand(x: Number) -> Number:
            s = self.extra_stress(x, ri)
            return (s[1, 1] - s[0, 0]) / x

        return -quad(integrand, r, self.outer(ri), **PASCAL)[0]

    def loads(self, ri: Number, P: Number) -> tuple[Number, Number]:
        """F = −2π ∫ σzz r dr + π r_i² P and M = −2π ∫ σθz r² dr with the full stresses."""

        def axial(r: Number) -> Number:
            s = self.extra_stress(r, ri)
            b = s[0, 0] - self.radial_stress(r, ri)
            return (s[2, 2] - b) * r

        def twisting(r: Number) -> Number:
            return self.extra_stress(r, ri)[1, 2] * r**2

        ro = self.outer(ri)
        force = -2 * math.pi * quad(axial, ri, ro, **NEWTON)[0] + math.pi * ri**2 * P
        moment = -2 * math.pi * quad(twisting, ri, ro, **NEWTON_METRE)[0]
        return force, moment


def continuum_row(
    gamma: Number,
    L: Number,
    Ri: Number,
    Ro: Number,
    l: Number,  # noqa: E741
    phi: Number,
    P: Number,
    C1: Number = None,
    C2: Number = None,
    psi1: Slope | None = None,
    psi2: Slope | None = None,
    psi4: Slope | None = None,
    second: Number = None,
) -> tuple[Number, Number, Number] | None:
    """(F [N], M [N·m], r_i [m]), or None where no r_i below 2.5 R_i carries the pressure P [Pa].

    The default energy's pressure grows steadily with r_i, so its value at 2.5 R_i decides. Another energy may
    have a limit point; its states are then judged by that one value too.
    """
    row = Row(
        gamma,
        L,
        Ri,
        Ro,
        l,
        phi,
        psi1 or (lambda i1, i2, i4: C1 / 2),
        psi2 or (lambda i1, i2, i4: 0.0),
        psi4 or (lambda i1, i2, i4: C2 * (i4 - 1)),
        second,
    )

    def excess(ri: Number) -> Number:
        return row.pressure(ri) - P

    low, high = 0.02 * Ri, BALLOON * Ri
    if excess(high) < 0:
        return None
    ri = brentq(excess, low, high, xtol=1e-16, rtol=1e-14)
    return (*row.loads(ri, P), ri)


def linear_row(
    gamma: Number,
    L: Number,
    Ro: Number,
    l: Number,  # noqa: E741
    phi: Number,
    P: Number,
    ka: Number,
    kb: Number,
    kc: Number,
) -> tuple[Number, Number]:
    """(F [N], M [N·m]) = (∂V/∂q)ᵀ P − K (l − L, φ), the volume V [m³] differentiated by complex steps."""
    B = L / math.cos(gamma)
    wrap = L / Ro * math.tan(gamma)

    def volume(length: Number, twist: Number) -> Number:
        return math.pi * (length * B**2 - length**3) / (wrap + twist) ** 2

    h = 1e-30
    force = volume(l + 1j * h, phi).imag / h * P - ka * (l - L) - kc * phi
    moment = volume(l, phi + 1j * h).imag / h * P - kc * (l - L) - kb * phi
    return force, moment
