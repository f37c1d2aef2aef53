"""Walls that remember: each material point softens by what it has been through, and relaxes since it was strained.

Softening: the pseudo-elasticity of Ogden & Roxburgh (1999). A point that stores Ψ < Ψ_max, the most that it ever
stored, has the stresses η ∂Ψ/∂F with η = 1 − erf((Ψ_max − Ψ)/m)/r. Relaxation: quasi-linear viscoelasticity with one
Prony term (Fung 1981; Simo 1987), a convolution of the isochoric second Piola-Kirchhoff stress of each point,
S(t) = ∫ (1 − g + g e^(−(t − s)/τ)) dSᵉ(s), Sᵉ = the softened elastic stress. The bed holds what it has imposed until
the next row, so Sᵉ changes in steps and the integral is a sum over the state's rows so far. A state begins afresh: the
move to it strains the wall so much more than a step of pressure does that what was relaxed before is not known.

The fluid's pressure neither softens nor relaxes; the inner radius is in equilibrium with the stresses that are left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import erf

from freelearn.testing.reference.backlash import bracketed_zero
from freelearn.testing.reference.braided import liner_energy
from freelearn.testing.reference.material_points import Points
from freelearn.testing.reference.total_energy import BALLOON, STEP, Effects

Array = np.ndarray[Any, Any]
# Rounds until the energies that are remembered are those that the softened wall stores.
ROUNDS, SETTLED = 30, 1e-10
TOLERANCE = 1e-13


@dataclass(frozen=True)
class Memory:
    """What the points bring into each row. most: (N, p) Pa, the most energy stored before the row. left: (4, N, p) Pa,
    the stress that the past adds, negative where it has relaxed."""

    most: Array
    left: Array

    def __getitem__(self, rows: Array) -> Memory:
        """Of some rows."""
        return Memory(self.most[rows], self.left[:, rows])


@dataclass(frozen=True)
class Law:
    """The material: C1, C2 [Pa] and the effects."""

    c1: float
    c2: float
    fx: Effects

    @property
    def remembers(self) -> bool:
        """Whether the stresses depend on the past."""
        return "stress_softening" in self.fx or "relaxation" in self.fx

    def energy(self, points: Points, strain: Array) -> Array:
        """Ψ (N, p) Pa of the virgin wall."""
        return points.energy(strain, self.c1, self.c2, self.fx)

    def softened(self, energy: Array, most: Array) -> Array | float:
        """η (N, p) of points that store `energy` [Pa] and have stored `most`."""
        if "stress_softening" not in self.fx:
            return 1.0
        p = self.fx["stress_softening"]
        below = np.maximum(most, energy) - energy
        return np.asarray(1 - p["inverse_r"] * erf(below / (p["energy"] * self.c1)))

    def slope(self, points: Points, memory: Memory, length: Array, twist: Array, u: Array) -> Array:
        """∂W/∂q (N,) of the stresses that are left, q the one of length, twist and u, each (N,), that bears a complex
        step. A bladder at the bore forgets what it has been through."""
        moved = points.strain(length, twist, u)
        energy = self.energy(points, moved)
        density = self.softened(energy.real, memory.most) * energy.imag + (memory.left * moved.imag).sum(0)
        stiffness = self.fx.get("bladder_stiffness", {}).get("stiffness", 0.0)
        bladder = liner_energy(length, twist, u, points.reference, points.inner, stiffness)
        return np.asarray(((points.weight * density).sum(1) + np.imag(bladder)) / STEP)


def radius_squared(points: Points, law: Law, memory: Memory) -> tuple[Array, Array]:
    """Square of the inner radius in equilibrium, (N,) m², and whether there is one, (N,) bool."""

    def excess(u: Array) -> Array:
        carried = law.slope(points, memory, points.length, points.twist, u + 1j * STEP)
        return carried / (np.pi * points.length) - points.pressure

    low, high = (0.3 * points.inner) ** 2, (BALLOON * points.inner) ** 2
    balanced = (excess(low) < 0) & ~(excess(high) <= 0)
    return bracketed_zero(excess, low, high, TOLERANCE), balanced


def loads(points: Points, law: Law, memory: Memory) -> tuple[Array, Array]:
    """Force [N] and moment [N·m] of the bare actuators (N, 2), and whether they are in equilibrium, (N,)."""
    u, balanced = radius_squared(points, law, memory)
    pull = law.slope(points, memory, points.length + 1j * STEP, points.twist, u)
    turn = law.slope(points, memory, points.length, points.twist + 1j * STEP, u)
    return np.stack([np.pi * u * points.pressure - pull, -turn], axis=1), balanced


def remembered(points: Points, law: Law, s: dict[str, Array]) -> Memory:
    """What every row's points bring along from the rows before, in the order of measuring.

    s: see `bed.state_of`. A row without an equilibrium leaves no memory: nobody measured what became of the wall there.
    """
    virgin = Memory(np.zeros(points.radius.shape), np.zeros((4, *points.radius.shape)))
    if not law.remembers:
        return virgin
    most = virgin.most
    for _ in range(ROUNDS if "stress_softening" in law.fx else 1):
        left, energy = _state_by_state(points, law, most, s)
        before, most = most, _most_before(energy, s["sample"])
        if np.abs(most - before).max() <= SETTLED * max(float(most.max()), 1e-300):
            break
    return Memory(most, left)


def _state_by_state(points: Points, law: Law, most: Array, s: dict[str, Array]) -> tuple[Array, Array]:
    """The stress that the past adds to every row, (4, N, p), and the energy stored in it, (N, p)."""
    time, place = s["dwell"], _place_in_state(s["dwell"])
    share, tau = (law.fx.get("relaxation", {}).get(name, 0.0) for name in ("share", "time"))
    shape = (4, *points.radius.shape)
    left, elastic, fresh = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    energy = np.zeros(points.radius.shape)
    for number in range(int(place.max()) + 1) if share else [-1]:
        rows = np.flatnonzero(place == number) if share else np.arange(len(place))
        past = rows - 1
        if number > 0:
            faded = np.exp(-(time[rows] - time[past]) / tau)[:, None] * fresh[:, past]
            left[:, rows] = share * (faded - elastic[:, past])
        part = points[rows]
        u, balanced = radius_squared(part, law, Memory(most[rows], left[:, rows]))
        strain = part.strain(part.length, part.twist, u)
        energy[rows] = np.where(balanced[:, None], law.energy(part, strain), 0.0)
        if not share:
            break
        stress = law.softened(energy[rows], most[rows]) * part.stress(strain, law.c1, law.c2, law.fx)
        if number > 0:
            elastic[:, rows] = np.where(balanced[:, None], stress, elastic[:, past])
            fresh[:, rows] = faded + elastic[:, rows] - elastic[:, past]
        else:
            elastic[:, rows] = fresh[:, rows] = np.where(balanced[:, None], stress, 0.0)
    return left, energy


def _most_before(energy: Array, sample: Array) -> Array:
    """The most energy stored in the sample's rows before each, (N, p)."""
    most = np.zeros(energy.shape)
    for number in dict.fromkeys(sample):
        rows = np.flatnonzero(sample == number)
        most[rows[1:]] = np.maximum.accumulate(energy[rows[:-1]], axis=0)
    return most


def _place_in_state(dwell: Array) -> Array:
    """Number of each row within its kinematic state, (N,): a state's first row has no dwell."""
    place = np.arange(len(dwell))
    return np.asarray(place - np.maximum.accumulate(np.where(dwell == 0, place, 0)))
