"""Shapes that the hybrid model's remainder is made of: coordinates without units, edges where it ends, kernels."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from freelearn.data.states import States

# Differences of design at which nothing is carried over any more, of (Γ, ln L, ln R_i, ln R_o, Γ₂): a half turn, and
# twice the radii or four times the length. Γ₂ of an actuator without a second family is ALONE.
FAR = (math.pi, math.log(4.0), math.log(2.0), math.log(2.0), math.pi)
ALONE = 10.0
# Two designs this much closer than FAR are the same one, cut and wound with the usual tolerance: 1.8° of Γ.
SAME = 0.01
# A coordinate of the state is 1 at the edge of the data. It is held between there and HELD; between FADES and GONE the
# remainder ends, of pressure earlier: pressure does no work on the mount, so nothing has to pay for a quick end.
HELD, FADES, GONE = 1.5, 2.0, 8.0
PRESSURE_FADES, PRESSURE_GONE = 1.5, 2.5


def designs(states: States) -> Tensor:
    """Coordinates of each row's design in units of FAR, (N, 5)."""
    second = torch.full_like(states.length, ALONE)
    if states.second_angle is not None and states.second_share is not None:
        second = torch.where(states.second_share > 0, states.second_angle, second)
    logs = [value.log() for value in (states.reference_length, states.inner_radius, states.outer_radius)]
    return torch.stack([states.fiber_angle, *logs, second], dim=-1) / torch.tensor(FAR, dtype=torch.float64).to(second)


def distances(one: Tensor, other: Tensor) -> Tensor:
    """Between designs (N, 5) and (D, 5): (N, D)."""
    return (one[:, None] - other).square().sum(-1).clamp_min(1e-30).sqrt()


def middle_radius(states: States) -> Tensor:
    """Of the wall, (N,) m."""
    return (states.inner_radius + states.outer_radius) / 2


def coordinates(states: States, modulus: Tensor) -> Tensor:
    """The state without units, (N, 3): stretch l/L − 1, shear R φ/L, pressure in units of the wall's modulus."""
    stretch = states.length / states.reference_length - 1
    shear = middle_radius(states) * states.twist / states.reference_length
    return torch.stack([stretch, shear, states.pressure / modulus], dim=-1)


def held(z: Tensor) -> tuple[Tensor, Tensor]:
    """z where |z| ≤ 1, kept from growing beyond HELD, and the slope, 1 to 0: twice differentiable."""
    width = HELD - 1
    u = ((z.abs() - 1) / width).clamp(0.0, 1.0)
    beyond = z.sign() * (1 + width * (u - u**3 + u**4 / 2))
    return torch.where(z.abs() <= 1, z, beyond), 1 - u * u * (3 - 2 * u)


def ending(z: Tensor, first: float, last: float) -> tuple[Tensor, Tensor]:
    """1 where |z| ≤ first, 0 where |z| ≥ last, and its slope by z: twice differentiable."""
    u = ((z.abs() - first) / (last - first)).clamp(0.0, 1.0)
    slope = -30 * u**2 * (1 - u) ** 2 / (last - first)
    return 1 - u**3 * (10 - 15 * u + 6 * u * u), slope * z.sign()


def alike(distance: Tensor) -> Tensor:
    """Wendland's function of five dimensions: 1 at no distance, positive definite, zero from 1 on."""
    far = distance.clamp(max=1.0)
    return (1 - far) ** 5 * (5 * far + 1)


def load_scale(states: States, moduli: Tensor, box: Tensor) -> Tensor:
    """Size of each row's design's loads over the box of states that was measured, (N, 2) N, N·m.

    Of the continuum model of small strains, with (e, a, g) of stretch, hoop strain and shear: per volume of the wall
    C1 (e² + a² + (e + a)² + g²/2) + 2 C2 (e cos²Γ + a sin²Γ + g sin Γ cos Γ)² − P R_i²/(R_o² − R_i²) (e + 2a), a free.
    moduli: C1, C2 Pa; box: the largest stretch, shear, and pressure/C1.
    """
    c1, c2 = moduli
    none = torch.zeros_like(states.length)
    fibers = [(states.fiber_angle, none + 1)]
    if states.second_angle is not None and states.second_share is not None:
        fibers.append((states.second_angle, states.second_share))
    ee, aa, ea, gg, eg, ag = none + 4 * c1, none + 4 * c1, none + 2 * c1, none + c1, none, none
    for angle, share in fibers:
        k, c, s = 4 * c2 * share, angle.cos(), angle.sin()
        ee, aa, gg = ee + k * c**4, aa + k * s**4, gg + k * (s * c) ** 2
        ea, eg, ag = ea + k * (s * c) ** 2, eg + k * s * c**3, ag + k * c * s**3
    bore = states.inner_radius**2 / (states.outer_radius**2 - states.inner_radius**2) * c1
    by_e, by_g = ea / aa, ag / aa
    by_stretch = torch.stack([ee - by_e * ea, eg - by_e * ag], dim=-1) * box[0]
    by_shear = torch.stack([eg - by_g * ea, gg - by_g * ag], dim=-1) * box[1]
    by_pressure = torch.stack([bore * (1 - 2 * by_e), -2 * bore * by_g], dim=-1) * box[2]
    area = math.pi * (states.outer_radius**2 - states.inner_radius**2)
    size = (by_stretch**2 + by_shear**2 + by_pressure**2).sqrt()
    return size * torch.stack([area, area * middle_radius(states)], dim=-1)
