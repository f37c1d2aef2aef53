"""The continuum model with one part of its nonlinearity taken out, to learn which part matters.

The paper leaves this ablation as future work. Each variant keeps everything else of the continuum model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.mechanics.energy import Energy, EnergySum, NeoHookean, StandardFiber
from freelearn.mechanics.inextensible import helix
from freelearn.mechanics.linear_material import LinearMaterial
from freelearn.mechanics.loads import tube_loads
from freelearn.mechanics.tube import Tube
from freelearn.models.base import Model, Values
from freelearn.models.continuum import Continuum
from freelearn.models.effect import Effect
from freelearn.models.material import RUBBER, Material
from freelearn.models.parameters import Parameters, parameter
from freelearn.models.ports import columns
from freelearn.models.prediction import Prediction, Status


class ContinuumLinearMaterial(Continuum):
    """Linear material, nonlinear deformation: Hooke's law in the finite strain instead of the neo-Hookean wall."""

    name = "continuum_linear_material"

    def base_energy(self, p: Material) -> list[Energy]:
        """The terms of the strain energy, with Hooke's law in place of the neo-Hookean one."""
        return [LinearMaterial(p.C1), StandardFiber(p.C2)]


class ContinuumThinWall(Continuum):
    """Thin wall: the stresses of the middle surface stand for the whole wall (one quadrature point)."""

    name = "continuum_thin_wall"
    points = 1


class Wall(Parameters):
    """C1: shear modulus of the wall [Pa]."""

    C1: Tensor = parameter("C₁", "Pa", start=1e5, lower=0.0, log=True, prior=RUBBER)


class ContinuumInextensible(Model[Wall]):
    """Inextensible fiber: a neo-Hookean thick wall, held by a helix on its outer surface that cannot stretch.

    I₄(R_o) = 1 fixes the outer radius, r_o² = (1 − λz² cos²Γ)/(sin Γ/R_o + k cos Γ)² (of two families see
    mechanics.inextensible), and incompressibility the inner one. The pressure that the wall does not carry is carried
    by the fiber's tension, which also pulls and turns. The fluid's part of the loads is that of the linear model.
    """

    name = "continuum_inextensible"
    family = "continuum_inextensible"
    parameter_class = Wall
    conservative = True
    relaxed_at_rest = True

    def __init__(self, C1: float = 1e5, effects: Sequence[Effect[Any]] = ()) -> None:
        super().__init__(effects, C1=C1)

    def structure(self, states: States, p: Wall) -> Prediction:
        """Loads of wall, fiber tension and fluid; a row that the fiber forbids is marked."""
        tube = Tube.from_states(states)
        wall = EnergySum([NeoHookean(p.C1)]).wall(tube)
        fibers, smallest = helix(states), 1e-2 * states.inner_radius**2
        # A fiber that is too short for the length would have to close the bore: the row is marked, and a finite number
        # keeps it from breaking a loss that it is not part of.
        overstretched = fibers.radius2 - tube.solid < smallest
        u = torch.where(overstretched, smallest, fibers.radius2 - tube.solid)
        # By virtual work: what the wall does not carry acts on the volume inside the fibers.
        carried = math.pi * (states.pressure - wall.carried(u).pressure)
        status = torch.where(overstretched, Status.OVERSTRETCHED, Status.OK)
        status = torch.where(fibers.singular, Status.SINGULAR, status).to(torch.uint8)
        return Prediction(tube_loads(wall, u) + columns(carried * fibers.by_length, carried * fibers.by_twist), status)

    def diameter(self, states: States, values: Values) -> Tensor:
        """As Chain.diameter: the fibers' own."""
        return 2 * helix(states).radius2.clamp_min(0.0).sqrt()
