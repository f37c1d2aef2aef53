"""The same tubes with one pair of moduli after another, as a fit asks for them."""

from __future__ import annotations

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.mechanics.closed_form import FiberWall, NeoHookeanWall
from freelearn.mechanics.equilibrium import Inflated, balance
from freelearn.mechanics.loads import loads_at
from freelearn.mechanics.sensitivity import modulus_rates
from freelearn.mechanics.tube import Tube
from freelearn.mechanics.wall import WallSum

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
        self.rubber, self.fiber = NeoHookeanWall.of(self.tube), FiberWall.of(self.tube)
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
