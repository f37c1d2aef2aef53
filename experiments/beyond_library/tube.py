"""A tube with a further strain energy: the second test bed's wall, with a place for what it does not know.

Energy, bisection for the inner radius and complex steps, as in freelearn.testing.reference.total_energy; one family of
fibers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from beyond_library.kind import Array

from freelearn.testing.reference.total_energy import (
    BALLOON,
    BISECTIONS,
    NODES,
    STEP,
    WEIGHTS,
    fiber_energy,
    rubber_energy,
)

# Invariants by name, complex (N, p) → Ψ [Pa].
Psi = Callable[[Mapping[str, Array]], Array]


def wall_energy(s: Mapping[str, Array], length: Array, twist: Array, u: Array, c1: float, c2: float, psi: Psi) -> Array:
    """W [J] of N tubes of inner radius √u; length, twist and u (N,) may be complex."""
    half = (s["outer"] - s["inner"]) / 2
    radius = s["inner"][:, None] + half[:, None] * (1 + NODES)
    axial, rate = (length / s["reference"])[:, None], (twist / s["reference"])[:, None]
    square = (radius**2 - s["inner"][:, None] ** 2) / axial + u[:, None]
    # C along (R, Θ, Z): invariants of C are those of B.
    thin, around, along = (radius / axial) ** 2 / square, square / radius**2, axial**2 + square * rate**2
    slide = square * rate / radius
    i1 = thin + around + along
    i2 = thin * around + thin * along + around * along - slide**2
    sine, cosine = np.sin(s["gamma"])[:, None], np.cos(s["gamma"])[:, None]
    i4 = around * sine**2 + 2 * slide * sine * cosine + along * cosine**2
    with np.errstate(invalid="ignore", over="ignore"):
        density = rubber_energy(i1, i2, c1, {}) + fiber_energy(i1, i4, c2, {}) + psi({"i1": i1, "i2": i2, "i4": i4})
        return np.asarray(s["reference"] * half * ((density * 2 * np.pi * radius) @ WEIGHTS))


def loads(s: Mapping[str, Array], c1: float, c2: float, psi: Psi) -> tuple[Array, Array]:
    """Force [N] and moment [N·m] (N, 2), and whether there is an equilibrium, (N,)."""
    length, twist, pressure = s["length"], s["twist"], s["pressure"]

    def excess(u: Array) -> Array:
        slope = wall_energy(s, length, twist, u + 1j * STEP, c1, c2, psi).imag / STEP
        return np.asarray(slope / (np.pi * length) - pressure)

    low, high = (0.3 * s["inner"]) ** 2, (BALLOON * s["inner"]) ** 2
    balanced = (excess(low) < 0) & ~(excess(high) <= 0)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        above = ~(excess(middle) <= 0)
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    u = (low + high) / 2 + 0j
    pull = wall_energy(s, length + 1j * STEP, twist, u, c1, c2, psi).imag / STEP
    turn = wall_energy(s, length, twist + 1j * STEP, u, c1, c2, psi).imag / STEP
    return np.stack([np.pi * u.real * pressure - pull, -turn], axis=1), balanced
