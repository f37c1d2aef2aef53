"""Material points of the wall: strains, energy and stresses, with fibers that scatter in space."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.optimize import brentq

from freelearn.testing.reference.total_energy import NODES, STEP, WEIGHTS, Effects, built, fiber_energy, rubber_energy

# How fibers scatter in space: means over a density of directions, by quadrature.
#
# The density is the π-periodic von Mises distribution of Gasser, Ogden & Holzapfel (2006), ρ(Θ) ∝ exp(b (cos 2Θ +
# 1)), Θ the angle to the mean direction, rotationally symmetric about it. Its dispersion is κ = ¼ ∫ ρ sin³Θ dΘ with
# their normalization of ρ: half the mean of sin²Θ over the sphere, 1/3 where b = 0.

Array = np.ndarray[Any, Any]
DENSITY_NODES, DENSITY_WEIGHTS = np.polynomial.legendre.leggauss(48)
# Directions about the mean one: exact for means of products of four direction cosines.
AROUND = 8
# Past this exponent the density is nothing.
NEGLIGIBLE = 40.0


def polar(b: float) -> tuple[Array, Array]:
    """cos Θ and weights (48,) that sum to one, of the density with concentration b ≥ 0."""
    least = np.sqrt(max(0.0, 1 - NEGLIGIBLE / (2 * b))) if b > 0 else 0.0
    cosine = least + (1 - least) / 2 * (1 + DENSITY_NODES)
    weight = DENSITY_WEIGHTS * np.exp(2 * b * (cosine**2 - 1))
    return cosine, weight / weight.sum()


def kappa_of(b: float) -> float:
    """Dispersion of the density with concentration b."""
    cosine, weight = polar(b)
    return float(weight @ (1 - cosine**2)) / 2


def concentration(kappa: float) -> float:
    """b of the density with dispersion 0 < κ < 1/3."""
    return float(np.exp(brentq(lambda log: kappa_of(np.exp(log)) - kappa, -12.0, 25.0, xtol=1e-13)))


def directions(gamma: Array, kappa: float) -> tuple[Array, Array]:
    """Fibers M (3, N, d) in (R, Θ, Z), scattered about (0, sin Γ, cos Γ), and their shares (d,); gamma: (N,) rad."""
    zero = np.zeros(len(gamma))
    along = np.stack([zero, np.sin(gamma), np.cos(gamma)])
    if kappa <= 0:
        return along[:, :, None], np.ones(1)
    across = np.stack([zero, np.cos(gamma), -np.sin(gamma)])
    outwards = np.stack([zero + 1, zero, zero])
    cosine, weight = polar(concentration(kappa))
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    cosine, turn = (x.ravel() for x in np.meshgrid(cosine, turn, indexing="ij"))
    sine = np.sqrt(1 - cosine**2)
    parts = zip((along, across, outwards), (cosine, sine * np.cos(turn), sine * np.sin(turn)), strict=True)
    return np.sum([axis[:, :, None] * share for axis, share in parts], axis=0), np.repeat(weight, AROUND) / AROUND


def products(fibers: Array) -> Array:
    """M⊗M (4, N, d) as it meets C: its RR, ΘΘ, twice its ΘZ, and its ZZ component."""
    radial, around, along = fibers
    return np.stack([radial**2, around**2, 2 * around * along, along**2])


def structure(gamma: Array, kappa: float) -> tuple[Array, Array]:
    """Mean of M⊗M over the density, (4, N), and its covariance, (4, 4, N); gamma: (N,) rad.

    The mean is the structure tensor, whose product with C is the mean squared stretch. The square of that is what
    Gasser, Ogden & Holzapfel (2006) store; the mean of the squares, Lanir's (1983) angular integration, is larger by
    the variance C:covariance:C, which is of first order in κ like the effect itself: see `literature`.
    """
    fibers, share = directions(gamma, kappa)
    each = products(fibers)
    mean = each @ share
    return np.asarray(mean), np.einsum("cnd,end,d->cen", each, each, share) - mean[:, None] * mean


# Material points of the wall: strains, energy and stresses of a thick tube at each point of a quadrature.
#
# Lagrangian: components of the right Cauchy-Green tensor C along (R, Θ, Z) and ∂Ψ/∂C beside them, so that stresses
# may depend on the history of each point. The order of components is RR, ΘΘ, ΘZ, ZZ; ∂Ψ/∂C_ΘZ counts both off-
# diagonal places, so that products over components are products of tensors.


@dataclass(frozen=True)
class Points:
    """The points of N tubes. radius: (N, p) m in the reference. weight: (N, p) m³, ∫ dV = Σ weight. mean: (f, 4, N),
    of M⊗M over the directions M of each family's fibers, NaN where a tube lacks it; spread: (f, 4, 4, N), its
    covariance as far as that stores energy. length [m], twist [rad], pressure [Pa], reference, inner [m]: (N,)."""

    radius: Array
    weight: Array
    mean: Array
    spread: Array
    length: Array
    twist: Array
    pressure: Array
    reference: Array
    inner: Array

    @classmethod
    def from_state(cls, s: dict[str, Array], fx: Effects) -> Points:
        """Of the states as the bed writes them (see `bed.state_of`), with the effects on the actuators' make."""
        s = built(s, fx)
        scatter = fx.get("fiber_dispersion", {})
        gammas = [s[name] for name in ("gamma", "gamma2") if name in s]
        families = [structure(gamma, scatter.get("kappa", 0.0)) for gamma in gammas]
        mean, spread = (np.stack(each) for each in zip(*families, strict=True))
        spread = spread * scatter.get("each_fiber", 0.0)
        half = (s["outer"] - s["inner"]) / 2
        radius = s["inner"][:, None] + half[:, None] * (1 + NODES)
        weight = 2 * np.pi * radius * (half * s["reference"])[:, None] * WEIGHTS
        return cls(radius, weight, mean, spread, s["length"], s["twist"], s["pressure"], s["reference"], s["inner"])

    def __getitem__(self, rows: Array) -> Points:
        """Some of the tubes; rows: their numbers, or a mask (N,)."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        tensors = ("mean", "spread")
        return Points(**{name: value[..., rows] if name in tensors else value[rows] for name, value in values.items()})

    def strain(self, length: Array, twist: Array, u: Array) -> Array:
        """C (4, N, p) at an inner radius √u; length, twist and u (N,) may be complex."""
        axial, rate = (length / self.reference)[:, None], (twist / self.reference)[:, None]
        square = (self.radius**2 - self.inner[:, None] ** 2) / axial + u[:, None]
        around, shear = square / self.radius**2, square * rate / self.radius
        return np.stack([(self.radius / axial) ** 2 / square, around, shear, axial**2 + square * rate**2])

    def energy(self, strain: Array, c1: float, c2: float, fx: Effects) -> Array:
        """Ψ (N, p) Pa at strains C (4, N, p), complex or real. A dispersed fiber's I₄ is the mean of all directions."""
        rr, tt, tz, zz = strain
        i1 = rr + tt + zz
        i2 = (i1**2 - (rr**2 + tt**2 + zz**2 + 2 * tz**2)) / 2
        aligned = {name: values for name, values in fx.items() if name != "fiber_dispersion"}
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            energy = rubber_energy(i1, i2, c1, fx)
            for mean, spread in zip(self.mean, self.spread, strict=True):
                i4 = np.einsum("cn,cnp->np", mean, strain)
                scatter = np.einsum("cnp,cen,enp->np", strain, spread, strain) if spread.any() else 0.0
                fibers = fiber_energy(i1, i4, c2, aligned) + c2 / 2 * scatter
                energy = energy + np.where(np.isnan(mean[1])[:, None], 0.0, fibers)
        return np.asarray(energy)

    def stress(self, strain: Array, c1: float, c2: float, fx: Effects) -> Array:
        """Isochoric ∂Ψ/∂C (4, N, p) Pa, half the second Piola-Kirchhoff stress, by complex steps; strain real."""
        slopes = np.empty(strain.shape)
        for k in range(len(strain)):
            moved = strain.astype(complex)
            moved[k] += 1j * STEP
            slopes[k] = self.energy(moved, c1, c2, fx).imag / STEP
        rr, tt, tz, zz = strain
        minor = tt * zz - tz**2
        inverse = np.stack([1 / rr, zz / minor, -2 * tz / minor, tt / minor])
        return np.asarray(slopes - (slopes * strain).sum(0) / 3 * inverse)
