"""How fibers scatter in space: means over a density of directions, by quadrature.

The density is the π-periodic von Mises distribution of Gasser, Ogden & Holzapfel (2006),
ρ(Θ) ∝ exp(b (cos 2Θ + 1)), Θ the angle to the mean direction, rotationally symmetric about it. Its dispersion is
κ = ¼ ∫ ρ sin³Θ dΘ with their normalization of ρ: half the mean of sin²Θ over the sphere, 1/3 where b = 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import brentq

Array = np.ndarray[Any, Any]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(48)
# Directions about the mean one: exact for means of products of four direction cosines.
AROUND = 8
# Past this exponent the density is nothing.
NEGLIGIBLE = 40.0


def polar(b: float) -> tuple[Array, Array]:
    """cos Θ and weights (48,) that sum to one, of the density with concentration b ≥ 0."""
    least = np.sqrt(max(0.0, 1 - NEGLIGIBLE / (2 * b))) if b > 0 else 0.0
    cosine = least + (1 - least) / 2 * (1 + NODES)
    weight = WEIGHTS * np.exp(2 * b * (cosine**2 - 1))
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
