"""Fibers that cannot stretch: the radius at which they lie, and how the volume inside answers to length and twist."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import torch
from torch import Tensor

from freelearn.data.states import States

# Fibers unwound to within this share of their angle Φ count as parallel to the axis.
SINGULAR_SHARE = 0.02


class Helix(NamedTuple):
    """N tubes that inextensible fibers on their outer surface hold. All (N,).

    radius2: r² [m²] of the fibers; negative where they are too short for the length. by_length, by_twist: ∂(r² l)/∂l
    [m²] and ∂(r² l)/∂φ [m³], so that a pressure P inside pushes with π P times the one and turns with π P times the
    other. singular: fibers (nearly) parallel to the axis; r² there is that of the nearest angle allowed.
    """

    radius2: Tensor
    by_length: Tensor
    by_twist: Tensor
    singular: Tensor


class _Family(NamedTuple):
    """One family: B² [m²], Φ + φ [rad], whether that is too near zero, and its weight (its share in a row, over B⁴)."""

    fiber2: Tensor
    turned: Tensor
    singular: Tensor
    weight: Tensor


def helix(states: States) -> Helix:
    """The fibers at N states.

    One family: r² = (B² − l²)/(Φ + φ)² with B = L/cos Γ and Φ = (L/R_o) tan Γ (Bruder et al. 2018; the paper's
    Eq. linearVolume). Two families cannot both keep their length at every length and twist: r² then is the one at which
    the sum of the squares of (r² (Φᵢ + φ)² + l²)/Bᵢ² − 1 is least, the limit of two families of standard fibers that
    are equally stiff (the continuum model's energy, C2 → ∞). A ±Γ braid so makes no moment at zero twist.
    """
    length, length2 = states.length, states.length**2
    first = _family(states, states.fiber_angle)
    if states.second_angle is None or states.second_share is None:
        radius2 = (first.fiber2 - length2) / first.turned**2
        by_length = radius2 - 2 * length2 / first.turned**2
        return Helix(radius2, by_length, -2 * length * radius2 / first.turned, first.singular)
    second = _family(states, states.second_angle, states.second_share)
    families = (first, second)
    # r² = Σ w t² (B² − l²) / Σ w t⁴ with t = Φ + φ.
    above = _sum(f.weight * f.turned**2 * (f.fiber2 - length2) for f in families)
    above_rate = _sum(2 * f.weight * f.turned * (f.fiber2 - length2) for f in families)
    below = _sum(f.weight * f.turned**4 for f in families)
    below_rate = _sum(4 * f.weight * f.turned**3 for f in families)
    spread = _sum(f.weight * f.turned**2 for f in families)
    radius2 = above / below
    return Helix(
        radius2,
        radius2 - 2 * length2 * spread / below,
        length * (above_rate - radius2 * below_rate) / below,
        first.singular & (second.singular | (states.second_share == 0)),
    )


def _family(states: States, angle: Tensor, share: Tensor | None = None) -> _Family:
    fiber2 = (states.reference_length / torch.cos(angle)) ** 2
    wrap = states.reference_length / states.outer_radius * torch.tan(angle)
    turned = wrap + states.twist
    singular = turned.abs() < SINGULAR_SHARE * wrap.abs()
    # The row is marked; a finite number keeps it from breaking a loss that it is not part of.
    turned = torch.where(singular, SINGULAR_SHARE * wrap, turned)
    return _Family(fiber2, turned, singular, (1.0 if share is None else share) / fiber2**2)


def _sum(parts: Iterable[Tensor]) -> Tensor:
    return torch.stack(list(parts)).sum(0)
