"""The same tubes with one pair of moduli after another, as a fit asks for them, and how their loads answer to these."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.physics.mechanics.closed_form import FiberWall, NeoHookeanWall
from freelearn.physics.mechanics.equilibrium import Inflated, balance, loads_at
from freelearn.physics.mechanics.tube import Tube
from freelearn.physics.mechanics.wall import WallSum


def modulus_rates(inflated: Inflated) -> Tensor | None:
    """∂loads/∂ln C of every energy's modulus C: (N, 2, terms) N, N·m; None for a wall without closed form.

    Each term's stresses are proportional to its modulus, so at fixed u a rate in ln C is the term's own part of the
    pressure and of the loads, and u gives way by du = −P_term/(dP/du) (implicit function theorem). A row without
    equilibrium stays at the bound and counts the thrust of the pressure that it does not carry.
    """
    wall, u, balanced, _ = inflated
    parts = wall.parts if isinstance(wall, WallSum) else [wall]
    closed = [part for part in parts if isinstance(part, NeoHookeanWall | FiberWall)]
    if len(closed) < len(parts):
        return None
    carried = [part.carried(u) for part in closed]
    slope = torch.stack([c.slope for c in carried]).sum(0)
    rates = [part.rates(u) for part in closed]
    tension, shear = (torch.stack(r).sum(0) for r in zip(*rates, strict=True))
    columns = []
    for part, (pressure, _) in zip(closed, carried, strict=True):
        own = part.resultants(u)
        give = torch.where(balanced, -pressure / slope, 0.0)
        thrust = torch.where(balanced, 0.0, u * pressure)
        columns += [-math.pi * (own.tension + give * tension + thrust), -2 * math.pi * (own.shear + give * shear)]
    return torch.stack(columns, dim=-1).reshape(len(u), len(closed), 2).mT


# The same tubes with one pair of moduli after another, as a fit asks for them.

# Radii below this share of the reference (of squares) are of no tube, but of moduli that a search tried too far out.
COLLAPSED = 1e-2


class SameTubes:
    """N tubes at fixed states with the paper's wall: what does not depend on the moduli is made once.

    The radius is looked for from where it was last, and the equilibrium is kept for the rates asked for next.
    Nothing here is recorded for autograd.
    """

    @torch.no_grad()
    def __init__(self, states: States) -> None:
        self.tube, self.pressure = Tube.from_states(states), states.pressure
        self.reference = states.inner_radius.square()
        self.rubber, self.fiber = NeoHookeanWall.from_tube(self.tube), FiberWall.from_tube(self.tube)
        self.moduli: Tensor | None = None
        self.inflated: Inflated

    @torch.no_grad()
    def loads(self, moduli: Tensor) -> Tensor:
        """Force and moment for moduli C1, C2 (2,) Pa: (N, 2) N, N·m."""
        return loads_at(self._at(moduli))

    @torch.no_grad()
    def rates(self, moduli: Tensor) -> Tensor:
        """∂loads/∂(ln C1, ln C2): (N, 2, 2) N, N·m."""
        rates = modulus_rates(self._at(moduli))
        assert rates is not None
        return rates

    def _at(self, moduli: Tensor) -> Inflated:
        if self.moduli is None or not torch.equal(moduli, self.moduli):
            wall = WallSum([self.rubber.scaled(moduli[0]), self.fiber.scaled(moduli[1])])
            self.inflated = balance(wall, self.tube, self.reference, self.pressure, self._near())
            self.moduli = moduli.clone()
        return self.inflated

    def _near(self) -> Tensor | None:
        """Where the radii are looked for first: where they were last, unless nothing led back from there."""
        if self.moduli is None:
            return None
        last = self.inflated.u
        # What is not a number is not larger either.
        return torch.where(last > COLLAPSED * self.reference, last, self.tube.unloaded_u)
