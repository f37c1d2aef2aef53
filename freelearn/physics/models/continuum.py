"""The paper's continuum model, a thick incompressible tube with an extensible helical fiber, and its variants."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.data.beds import INFLATION
from freelearn.data.states import States
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.material import RUBBER, Material
from freelearn.physics.chain.model import Bound, Model, Values
from freelearn.physics.chain.parameters import Parameters, parameter
from freelearn.physics.chain.ports import EnergyEffect, columns
from freelearn.physics.chain.prediction import Prediction, Status, SwollenPrediction
from freelearn.physics.mechanics.energy import Energy, EnergySum, LinearMaterial, NeoHookean, StandardFiber
from freelearn.physics.mechanics.equilibrium import Inflated, inflate, loads_at, tube_loads
from freelearn.physics.mechanics.inextensible import helix
from freelearn.physics.mechanics.same_tubes import SameTubes
from freelearn.physics.mechanics.tube import Tube

# The paper's continuum model: a thick incompressible rubber tube with an extensible helical fiber.

# What the paper fixes for the constituents (Sedal et al. 2018) [Pa].
CONSTITUENT = {"C1": 5e5, "C2": 1e6}


class Continuum(Model[Material]):
    """Ψ = C1/2 (I₁ − 3) + C2/2 (I₄ − 1)², thick wall in radial equilibrium with the pressure.

    C1: shear modulus of the wall [Pa]; C2: stiffness of the fiber per wall volume [Pa]; both positive, fitted as
    logarithms. Source: the paper's Section "Nonlinear Continuum Model"; Sedal et al. 2018.
    """

    name = "continuum"
    family = "continuum"
    parameter_class = Material
    conservative = True
    relaxed_at_rest = True
    # Quadrature points through the wall; None integrates in closed form where an energy has one.
    points: int | None = None

    def __init__(self, C1: float = 1e5, C2: float = 1e6, effects: Sequence[Effect[Any]] = (), **more: float) -> None:
        """C1, C2: Pa. more: of the parameters that a derived class adds, SI. Raises UserError."""
        super().__init__(effects, C1=C1, C2=C2, **more)
        self._energy = self._of(EnergyEffect)

    def base_energy(self, p: Material) -> list[Energy]:
        """The terms of the strain energy that the model itself has."""
        return [NeoHookean(p.C1), StandardFiber(p.C2)]

    def energy(self, values: Values, states: States) -> EnergySum:
        """The strain energy of the walls of these states: the model's own terms, then those of the effects."""
        return EnergySum([*self.base_energy(self.own(values)), *(e.term(values, states) for e in self._energy)])

    def bare(self, states: States, values: Values) -> Prediction:
        """Loads of the tube in radial equilibrium; without one, those of a ballooned tube."""
        inflated = inflate(states, self.energy(values, states), self.points)
        status = torch.where(inflated.balanced, Status.OK, Status.NO_EQUILIBRIUM).to(torch.uint8)
        if states.bed is not INFLATION:
            return Prediction(loads_at(inflated), status)
        return SwollenPrediction.of(loads_at(inflated), status, _outer_diameter(inflated, states))

    def diameter(self, states: States, values: Values) -> Tensor:
        """As Chain.diameter."""
        return _outer_diameter(inflate(states, self.energy(values, states), self.points), states)

    def bind(self, states: States) -> Bound | None:
        """Without effects both parameters are logarithms of moduli, and the rest is made once."""
        # A class derived from this one may be another wall.
        plain = type(self) is Continuum and not self.effects
        return _BoundContinuum(states) if plain and states.bed.loads and not states.members else None


def _outer_diameter(inflated: Inflated, states: States) -> Tensor:
    """2 r_o (N,) m, with r_o² = r_i² + (R_o² − R_i²)/λz."""
    return 2 * (inflated.u + Tube.from_states(states).solid).sqrt()


class _BoundContinuum:
    """The continuum at fixed states (see base.Bound)."""

    def __init__(self, states: States) -> None:
        self.tubes = SameTubes(states)

    def loads(self, vector: Tensor) -> Tensor:
        return self.tubes.loads(vector.exp())

    def jacobian(self, vector: Tensor) -> Tensor:
        return self.tubes.rates(vector.exp())


# The continuum model with one part of its nonlinearity taken out, to learn which part matters.
#
# The paper leaves this ablation as future work. Each variant keeps everything else of the continuum model.


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
    inextensible), and incompressibility the inner one. The pressure that the wall does not carry is carried
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
