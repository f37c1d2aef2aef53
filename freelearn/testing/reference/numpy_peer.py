"""The continuum model in vectorized NumPy, as a good engineer would write it: the peer of the benchmarks.

Eight Gauss-Legendre points through the reference wall; the inner radius by Newton's method with the exact
slope, inside a bracket, all rows at once until the slowest has converged.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Numbers = float | Array

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
BALLOON = 2.5


def continuum(
    gamma: Array, L: Array, Ri: Array, Ro: Array, length: Array, phi: Array, P: Array, C1: Numbers, C2: Numbers
) -> tuple[Array, Array]:
    """Arrays (N,) in SI → F (N,) N, M (N,) N·m, NaN where no inner radius below 2.5 R_i carries P. C1, C2: of all, or
    of each (N,).

    P = ∫ (σθθ − σrr)/r dr, F = −π ∫ (2σzz − σrr − σθθ) r dr, M = −2π ∫ σθz r² dr, with dr = R/(r λz) dR and σ
    without b.
    """
    stretch, k = length / L, phi / L
    half = (Ro - Ri) / 2
    R = Ri + half * (1 + NODES[:, None])
    weight = WEIGHTS[:, None] * half * R / stretch  # ∫ f r dr = Σ weight f
    cos = np.cos(gamma)
    g = np.sin(gamma) / R + k * cos
    g2, R2 = g * g, R * R
    offset = (R2 - Ri**2) / stretch  # r² = offset + r_i²
    # (σθθ − σrr)/r² = constant + linear r² − hoop/r⁴: the part that does not change with r_i is summed once.
    linear = weight * (2 * C2 * g2 * g2)
    hoop = weight * R2 * (C1 / stretch**2)
    constant = weight * (C1 * (1 / R2 + k**2) + 2 * C2 * ((stretch * cos) ** 2 - 1) * g2)
    slope0 = linear.sum(0)
    base = (constant + linear * offset).sum(0) - P

    def excess(x: Array) -> tuple[Array, Array]:
        """(pressure carried at r_i² = x) − P, and its slope by x."""
        inverse = 1 / (offset + x)
        part = hoop * inverse * inverse
        return base + slope0 * x - part.sum(0), slope0 + 2 * (part * inverse).sum(0)

    low, high = (0.02 * Ri) ** 2, (BALLOON * Ri) ** 2
    balanced = excess(high)[0] >= 0
    x = Ri**2 / stretch
    for _ in range(100):
        value, slope = excess(x)
        low, high = np.where(value < 0, x, low), np.where(value < 0, high, x)
        new = x - value / slope
        new = np.where((new >= low) & (new <= high), new, (low + high) / 2)
        done = np.abs(new - x) <= 1e-11 * x
        x = new
        if np.all(done | ~balanced):
            break

    r2 = offset + x
    fiber = C2 * (r2 * g2 + (stretch * cos) ** 2 - 1)
    srr = C1 * R2 / (r2 * stretch**2)
    stt = C1 * r2 * (1 / R2 + k**2) + 2 * fiber * r2 * g2
    szz = (C1 + 2 * fiber * cos**2) * stretch**2
    twisting = r2 * stretch * (C1 * k + 2 * fiber * g * cos)  # σθz r
    force = -np.pi * (weight * (2 * szz - srr - stt)).sum(0)
    moment = -2 * np.pi * (weight * twisting).sum(0)
    return np.where(balanced, force, np.nan), np.where(balanced, moment, np.nan)


def continuum_plain(
    gamma: Array, L: Array, Ri: Array, Ro: Array, length: Array, phi: Array, P: Array, C1: float, C2: float
) -> tuple[Array, Array]:
    """The same model as its equations are usually typed in: stresses at given radii, Newton with a difference quotient.

    Nothing is summed ahead or known of the energy's form, so another energy is a changed line.
    """
    stretch, k = length / L, phi / L
    R = Ri + (Ro - Ri) / 2 * (1 + NODES[:, None])
    weight = WEIGHTS[:, None] * (Ro - Ri) / 2

    def stresses(ri: Array) -> tuple[Array, ...]:
        r = np.sqrt((R**2 - Ri**2) / stretch + ri**2)
        axial = stretch * np.cos(gamma)
        hoop = r * (np.sin(gamma) / R + k * np.cos(gamma))
        fiber = 2 * C2 * (hoop**2 + axial**2 - 1)
        rr = C1 * (R / (r * stretch)) ** 2
        tt = C1 * ((r / R) ** 2 + (r * k) ** 2) + fiber * hoop**2
        zz = C1 * stretch**2 + fiber * axial**2
        tz = C1 * r * k * stretch + fiber * hoop * axial
        return r, weight * R / (r * stretch), rr, tt, zz, tz

    def excess(ri: Array) -> Array:
        r, width, rr, tt, _, _ = stresses(ri)
        return np.asarray(((tt - rr) / r * width).sum(0) - P)

    low, high = 0.02 * Ri, BALLOON * Ri
    balanced = excess(high) >= 0
    ri = Ri / np.sqrt(stretch)
    for _ in range(100):
        value = excess(ri)
        low, high = np.where(value < 0, ri, low), np.where(value < 0, high, ri)
        step = 1e-7 * ri
        new = ri - value * step / (excess(ri + step) - value)
        new = np.where((new >= low) & (new <= high), new, (low + high) / 2)
        done = np.abs(new - ri) <= 1e-10 * ri
        ri = new
        if np.all(done | ~balanced):
            break
    r, width, rr, tt, zz, tz = stresses(ri)
    force = -np.pi * ((2 * zz - rr - tt) * r * width).sum(0)
    moment = -2 * np.pi * (tz * r**2 * width).sum(0)
    return np.where(balanced, force, np.nan), np.where(balanced, moment, np.nan)


def linear(
    gamma: Array, L: Array, Ro: Array, length: Array, phi: Array, P: Array, ka: float, kb: float, kc: float
) -> tuple[Array, Array]:
    """The linear model in vectorized NumPy: arrays (N,) in SI → F (N,) N, M (N,) N·m."""
    B2, turned = (L / np.cos(gamma)) ** 2, L / Ro * np.tan(gamma) + phi
    force = np.pi * (B2 - 3 * length**2) / turned**2 * P - ka * (length - L) - kc * phi
    moment = -2 * np.pi * length * (B2 - length**2) / turned**3 * P - kc * (length - L) - kb * phi
    return force, moment


def network(x: Array, weights: Array) -> Array:
    """A 7-6-2 tanh network: inputs (N, 7), 62 weights → (N, 2)."""
    W, o, U, p = weights[:42].reshape(6, 7), weights[42:48], weights[48:60].reshape(2, 6), weights[60:]
    return np.asarray(np.tanh(x @ W.T + o) @ U.T + p)
