"""Radial equilibrium: the inner radius at which the wall carries the pressure, and the loads on the mount."""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor, addcmul

from freelearn.common.vmapped import all_if_known, indices_if_known
from freelearn.data.states import States
from freelearn.physics.mechanics.energy import EnergySum
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.mechanics.wall import Wall

# Radial equilibrium: the inner radius at which the wall carries the pressure.

# Beyond this inner radius (in reference radii) a tube counts as ballooned: no equilibrium.
BALLOON = 2.5
# A step this small (relative to u) ends the search. It leaves an error of about its square after Newton's step and of
# its cube after Halley's, so 1e-8 and less, which the differentiable step in `inflate` squares once more.
NEWTON_TOLERANCE = 1e-5
HALLEY_TOLERANCE = 1e-4
# From a start nearby the first step is small already, and no longer one of many: then it has to be this much smaller.
NEARER = 1e-2
# Largest change of u = r_i² in one iteration, as a factor; and before the stable branch, which may be short.
NEWTON_GROWTH = 1.6
HALLEY_GROWTH = 2.5
OUTWARD = 1.25
QUICK_ITERATIONS = 15
# By this name States.near keeps the radii.
RADIUS = "radius"
MAX_ITERATIONS = 60


class Inflated(NamedTuple):
    """Tubes at their equilibrium: u = r_i² [m²], whether it is one, and the pressure the wall leaves unbalanced [Pa].

    All (N,). Without an equilibrium u is the ballooning bound, and `unbalanced` what the wall does not carry there;
    with one it is zero. wall: what the energy carries in these tubes.
    """

    wall: Wall
    u: Tensor
    balanced: Tensor
    unbalanced: Tensor


def inflate(states: States, energy: EnergySum, points: int | None = None) -> Inflated:
    """Radial equilibrium of every row, with exact first derivatives, forward, reverse and under vmap.

    points: of a quadrature through the wall; None takes closed forms where an energy has them.

    By the implicit function theorem du = −(∂P_wall/∂θ dθ − dP)/(∂P_wall/∂u). One more Newton step from the
    solution, with its slope cut from the derivative, has just this derivative, and polishes u besides.
    Source: Krantz & Parks, The Implicit Function Theorem, 2003.
    """
    tube, near = Tube.from_states(states, points), states.near
    start = None if near is None else near.last(RADIUS, states.pressure)
    if start is not None:
        start = torch.where(start.isfinite(), start, tube.unloaded_u.detach())
    inflated = balance(energy.wall(tube), tube, states.inner_radius.square(), states.pressure, start)
    if near is not None:
        near.keep(RADIUS, inflated.u, inflated.balanced)
    return inflated


def balance(wall: Wall, tube: Tube, reference: Tensor, pressure: Tensor, near: Tensor | None = None) -> Inflated:
    """The equilibrium of a wall as a function of u: see `inflate`. All tensors (N,).

    reference: R_i² [m²]. near: where to look first, u of a like problem; the unloaded tube's by default.
    """
    with torch.no_grad():
        u, balanced = _solve(wall.detach(), reference.detach(), tube.unloaded_u.detach(), pressure.detach(), near)
    carried, slope = wall.carried(u)
    excess = carried - pressure
    # Without an equilibrium the row stays at the bound: no step and no derivative through u.
    gain = balanced / torch.where(balanced, slope.detach(), 1.0)
    return Inflated(wall, u - excess * gain, balanced, torch.where(balanced, 0.0, -excess))


def _solve(
    wall: Wall, reference: Tensor, unloaded: Tensor, pressure: Tensor, near: Tensor | None
) -> tuple[Tensor, Tensor]:
    """u = r_i² of every tube, no derivatives, and whether it is an equilibrium, both (N,).

    reference: R_i² [m²]. unloaded, near: u of the tube under no load, and of a like problem, where plain steps begin if
    there is one. The bracketed search begins at the former: from a place beyond a limit point it would go on to where
    the tube never comes.

    The stable branch is the one that the tube reaches from its reference radius, with dP/du > 0. A row has no
    equilibrium when the wall at BALLOON · R_i still carries less than the pressure, or when the pressure that it
    can carry passes a maximum (a limit point) on the way. Of a tube that is pushed together, whose fibers have to bulge
    out, the stable branch begins beyond a minimum, and the unloaded radius lies before it.

    A wall that stiffens all along needs no bracket, and plain steps of bounded size are several times cheaper; rows
    that meet a falling branch there or do not settle are left to the bracketed search.
    """
    ceiling = (BALLOON**2 * reference).expand_as(pressure)
    unloaded = unloaded.expand_as(pressure)
    start = unloaded if near is None else near
    if wall.stiffens:
        u, settled = _halley(wall, start, ceiling, pressure, near is not None)
    else:
        u, settled = _newton(wall, start, ceiling, pressure, near is not None)
        if all_if_known(settled) is None:  # inside vmap every row takes as many steps as the slowest
            return _search(wall, unloaded, ceiling, pressure)
    settled, left = settled & (u < ceiling), indices_if_known(~settled)
    if left is not None and len(left):
        found, balanced = _search(wall.some(left, len(u)), unloaded[left], ceiling[left], pressure[left])
        u, settled = u.index_copy(0, left, found), settled.index_copy(0, left, balanced)
    return u, settled


def _halley(wall: Wall, start: Tensor, ceiling: Tensor, pressure: Tensor, near: bool = False) -> tuple[Tensor, Tensor]:
    """u and which rows settled, by Halley's third-order steps on a wall that stiffens.

    Inside vmap, where nobody can know whether all did, every row takes all steps.
    """
    u, tolerance = start, HALLEY_TOLERANCE * (NEARER if near else 1.0)
    settled = torch.zeros_like(start, dtype=torch.bool)
    for i in range(QUICK_ITERATIONS):
        expansion = wall.expansion(u)
        lack, rise = pressure - expansion.pressure, expansion.rise
        square = rise * rise
        # At most twice Newton's step: far below the root the parabola has none.
        square = torch.maximum(addcmul(square, lack, expansion.bend, value=0.5), 0.5 * square)
        step = (lack * rise / square).clamp(1 / HALLEY_GROWTH - 1, HALLEY_GROWTH - 1)
        target = torch.minimum(addcmul(u, u, step), ceiling)
        if i or near:
            # A row that stays at the bound is done: it balloons. No first step is small, unless the start is near.
            settled = (target - u).abs() <= tolerance * u
        u = target
        if all_if_known(settled):
            break
    return u, settled


def _newton(wall: Wall, start: Tensor, ceiling: Tensor, pressure: Tensor, near: bool) -> tuple[Tensor, Tensor]:
    """u and which rows settled without that the pressure fell on the way, by Newton's steps."""
    u, tolerance = start, NEWTON_TOLERANCE * (NEARER if near else 1.0)
    softest = torch.full_like(u, torch.inf)
    for _ in range(QUICK_ITERATIONS):
        value, slope = wall.carried(u)
        softest = torch.minimum(softest, slope)
        target = u - (value - pressure) / slope
        target = torch.minimum(torch.clamp(target, u / NEWTON_GROWTH, u * NEWTON_GROWTH), ceiling)
        rises = softest > 0  # of what is no number neither
        settled = (target - u).abs() <= tolerance * u
        u = target
        if all_if_known(settled | ~rises) is not False:
            break
    return u, settled & rises


def _search(wall: Wall, start: Tensor, ceiling: Tensor, pressure: Tensor) -> tuple[Tensor, Tensor]:
    """Newton's method inside a bracket, for any wall: as `_solve`. start: on the stable branch or before it."""
    low, high = 1e-4 * ceiling, ceiling
    u = start
    lost = torch.zeros_like(u, dtype=torch.bool)
    risen = lost
    for _ in range(MAX_ITERATIONS):
        value, slope = wall.carried(u)
        excess = value - pressure
        short = excess < 0
        # Carrying too little at the bound, or on a branch that falls after it rose: only ballooning ahead. What is no
        # number leads nowhere.
        falls = slope <= 0
        low = torch.where(short, u, low)
        high = torch.where(short, high, u)
        ahead = high >= ceiling  # nowhere is as much carried yet
        lost = lost | (short & ahead & ((u >= ceiling) | (falls & risen))) | slope.isnan()
        risen = risen | ~falls
        # Bounded steps, so that a limit point is met and not jumped over; bisection along a falling branch.
        newton = torch.minimum(torch.maximum(u - excess / slope, u / NEWTON_GROWTH), u * NEWTON_GROWTH)
        target = torch.where(falls, torch.where(short & ahead, u * OUTWARD, (low + high) / 2), newton)
        target = torch.maximum(torch.minimum(target, high), low)
        done = lost | ((target - u).abs() <= NEWTON_TOLERANCE * u)
        u = target
        if all_if_known(done):
            break
    balanced = done & ~lost
    return torch.where(balanced, u, ceiling), balanced


def tube_loads(wall: Wall, u: Tensor) -> Tensor:
    """Force and moment of tubes with inner radius √u in radial equilibrium: (N, 2) N, N·m.

    F = −π ∫ (2σzz − σrr − σθθ) r dr and M = −2π ∫ σθz r² dr. Neither the Lagrange multiplier nor the pressure appears:
    integrating the radial equilibrium by parts removes both (start from the paper's Eqs. force and moment).
    """
    tension, shear = wall.resultants(u)
    return torch.stack([-math.pi * tension, -2 * math.pi * shear], dim=-1)


def loads_at(inflated: Inflated) -> Tensor:
    """Force and moment (N, 2) N, N·m at the equilibrium, and beyond its end.

    There the thrust of the pressure that a ballooned wall does not carry is added: a loss that goes on past the
    equilibrium's end grows, instead of rewarding a wall too soft for the pressure.
    """
    tension, shear = inflated.wall.resultants(inflated.u)
    force = -math.pi * (tension - inflated.u * inflated.unbalanced)
    return torch.stack([force, -2 * math.pi * shear], dim=-1)
