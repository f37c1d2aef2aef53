"""The paper's two physics models, one row at a time, straight from the equations: slow, and not clever.

Nothing here is shared with the package. The wall is followed in the current configuration, the radius comes from
SciPy's brentq, every integral from SciPy's quad, and the Lagrange multiplier b(r) is computed and used. SI units.
"""

import math

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

TIGHT = {"epsabs": 0.0, "epsrel": 1e-11, "limit": 200}
BALLOON = 2.5


class Row:
    """One deformed tube with inner radius r_i; psi1, psi2, psi4: ∂Ψ/∂I as functions of (I1, I2, I4)."""

    def __init__(self, gamma, L, Ri, Ro, length, phi, psi1, psi2, psi4):
        self.gamma, self.L, self.Ri, self.Ro, self.length, self.phi = gamma, L, Ri, Ro, length, phi
        self.psi = psi1, psi2, psi4
        self.stretch = length / L

    def outer(self, ri):
        return math.sqrt(ri**2 + (self.Ro**2 - self.Ri**2) / self.stretch)

    def extra_stress(self, r, ri):
        """σ + b I at current radius r: (3, 3) Pa in (r, θ, z)."""
        R = math.sqrt(self.Ri**2 + self.stretch * (r**2 - ri**2))
        F = np.array([[R / (r * self.stretch), 0, 0], [0, r / R, r * self.phi / self.L], [0, 0, self.stretch]])
        B = F @ F.T
        a = F @ np.array([0, math.sin(self.gamma), math.cos(self.gamma)])
        i1 = np.trace(B)
        i2 = (i1**2 - np.trace(B @ B)) / 2
        i4 = a @ a
        psi1, psi2, psi4 = (psi(i1, i2, i4) for psi in self.psi)
        return 2 * psi1 * B + 2 * psi2 * (i1 * B - B @ B) + 2 * psi4 * np.outer(a, a)

    def pressure(self, ri):
        """P = ∫ (σθθ − σrr)/r dr over the current wall."""

        def integrand(r):
            s = self.extra_stress(r, ri)
            return (s[1, 1] - s[0, 0]) / r

        return quad(integrand, ri, self.outer(ri), **TIGHT)[0]

    def radial_stress(self, r, ri):
        """σrr(r) = −∫_r^{r_o} (σθθ − σrr)/r dr, from dσrr/dr = (σθθ − σrr)/r and σrr(r_o) = 0."""

        def integrand(x):
            s = self.extra_stress(x, ri)
            return (s[1, 1] - s[0, 0]) / x

        return -quad(integrand, r, self.outer(ri), **TIGHT)[0]

    def loads(self, ri, P):
        """F = −2π ∫ σzz r dr + π r_i² P and M = −2π ∫ σθz r² dr with the full stresses."""

        def axial(r):
            s = self.extra_stress(r, ri)
            b = s[0, 0] - self.radial_stress(r, ri)
            return (s[2, 2] - b) * r

        def twisting(r):
            return self.extra_stress(r, ri)[1, 2] * r**2

        ro = self.outer(ri)
        force = -2 * math.pi * quad(axial, ri, ro, epsabs=0.0, epsrel=1e-10)[0] + math.pi * ri**2 * P
        moment = -2 * math.pi * quad(twisting, ri, ro, **TIGHT)[0]
        return force, moment


def continuum_row(gamma, L, Ri, Ro, l, phi, P, C1=None, C2=None, psi1=None, psi2=None, psi4=None):  # noqa: E741
    """(F, M, r_i), or None where no r_i below 2.5 R_i carries the pressure P [Pa]."""
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
    )

    def excess(ri):
        return row.pressure(ri) - P

    low, high = 0.02 * Ri, BALLOON * Ri
    if excess(high) < 0:
        return None
    ri = brentq(excess, low, high, xtol=1e-16, rtol=1e-14)
    return (*row.loads(ri, P), ri)


def linear_row(gamma, L, Ro, l, phi, P, ka, kb, kc):  # noqa: E741
    """(F, M) of the lumped model; the fluid's part by complex-step differences of its volume."""
    B = L / math.cos(gamma)
    wrap = L / Ro * math.tan(gamma)

    def volume(length, twist):
        return math.pi * (length * B**2 - length**3) / (wrap + twist) ** 2

    h = 1e-30
    force = volume(l + 1j * h, phi).imag / h * P - ka * (l - L) - kc * phi
    moment = volume(l, phi + 1j * h).imag / h * P - kc * (l - L) - kb * phi
    return force, moment
