"""Radial equilibrium: the inner radius at which the wall carries the pressure."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.mechanics.energy import EnergySum, Hoop
from freelearn.mechanics.tube import QUADRATURE_POINTS, Tube

# Beyond this inner radius (in reference radii) a tube counts as ballooned: no equilibrium.
BALLOON = 2.5
# A Newton step this small (relative to u) leaves an error of about its square, which the differentiable step
# in `inflate` squares once more.
TOLERANCE = 1e-4
# Largest change of u = r_i² in one iteration, as a factor.
GROWTH = 1.6
QUICK_ITERATIONS = 15
MAX_ITERATIONS = 60


class Inflated(NamedTuple):
    """A tube at its equilibrium: u = r_i² [m²], whether it is one, and the pressure the wall leaves unbalanced [Pa].

    All (N,). Without an equilibrium u is the ballooning bound, and `unbalanced` what the wall does not carry there;
    with one it is zero.
    """

    tube: Tube
    u: Tensor
    found: Tensor
    unbalanced: Tensor


def inflate(states: States, energy: EnergySum, points: int = QUADRATURE_POINTS) -> Inflated:
    """Radial equilibrium of every row, with exact first derivatives, forward, reverse and under vmap.

    points: of the quadrature through the wall.

    By the implicit function theorem du = −(∂P_wall/∂θ dθ − dP)/(∂P_wall/∂u). One more Newton step from the
    solution, with its slope cut from the derivative, has just this derivative, and polishes u besides.
    Source: Krantz & Parks, The Implicit Function Theorem, 2003.
    """
    tube = Tube.from_states(states, points)
    still = tube.detach()
    with torch.no_grad():
        u, found = _solve(energy.detach().hoop(still), still, states.pressure.detach())
        u = u.detach()
    carried, slope = energy.hoop(tube)(u)
    # Without an equilibrium the row stays at the bound: no step and no derivative through u.
    gain = found / torch.where(found, slope.detach(), 1.0)
    excess = carried - states.pressure
    return Inflated(tube, u - excess * gain, found, torch.where(found, 0.0, -excess))


def _solve(carried: Hoop, tube: Tube, pressure: Tensor) -> tuple[Tensor, Tensor]:
    """Inner radius of every tube, no derivatives: (u, found), both (N,).

    The stable branch is the one that the tube reaches from its reference radius, with dP/du > 0. A row has no
    equilibrium when the wall at BALLOON · R_i still carries less than the pressure, or when the pressure that it
    can carry passes a maximum (a limit point) on the way.

    A wall that stiffens all along needs no bracket, and plain Newton steps of bounded size are several times
    cheaper; where they meet a falling branch or do not settle, the bracketed search does the work.
    """
    ceiling = (BALLOON**2 * tube.reference_u).expand_as(pressure)
    u = (tube.reference_u / tube.axial).expand_as(pressure)
    softest = torch.full_like(u, torch.inf)
    for _ in range(QUICK_ITERATIONS):
        value, slope = carried(u)
        softest = torch.minimum(softest, slope)
        target = u - (value - pressure) / slope
        target = torch.minimum(torch.clamp(target, u / GROWTH, u * GROWTH), ceiling)
        # A row that stays at the bound is done: it balloons.
        settled = _all((target - u).abs() <= TOLERANCE * u)
        u = target
        if settled and _all(softest > 0):
            return u, u < ceiling
        if settled is None:
            break
    return _search(carried, tube, pressure)


def _search(carried: Hoop, tube: Tube, pressure: Tensor) -> tuple[Tensor, Tensor]:
    """Newton's method inside a bracket, for walls of any kind: as `_solve`."""
    ceiling = (BALLOON**2 * tube.reference_u).expand_as(pressure)
    low, high = 1e-4 * ceiling, ceiling
    u = (tube.reference_u / tube.axial).expand_as(pressure)
    lost = torch.zeros_like(u, dtype=torch.bool)
    for _ in range(MAX_ITERATIONS):
        value, slope = carried(u)
        excess = value - pressure
        short = excess < 0
        # Carrying too little at the bound, or on a falling branch beyond the reference: only ballooning ahead.
        lost = lost | (short & ((u >= ceiling) | ((slope <= 0) & (u > tube.reference_u))))
        low = torch.where(short, u, low)
        high = torch.where(short, high, u)
        # Bounded steps, so that a limit point is met and not jumped over; bisection along a falling branch.
        newton = torch.minimum(torch.maximum(u - excess / slope, u / GROWTH), u * GROWTH)
        target = torch.where(slope > 0, newton, (low + high) / 2)
        target = torch.maximum(torch.minimum(target, high), low)
        done = lost | ((target - u).abs() <= TOLERANCE * u)
        u = target
        if _all(done):
            break
    found = done & ~lost
    return torch.where(found, u, ceiling), found


def _all(mask: Tensor) -> bool | None:
    """Whether all rows are done; None inside vmap, where nobody can know."""
    try:
        return bool(mask.all())
    except RuntimeError:
        return None
