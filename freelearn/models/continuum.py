"""The paper's continuum model: a thick incompressible rubber tube with an extensible helical fiber."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.mechanics.energy import Energy, EnergySum, NeoHookean, StandardFiber
from freelearn.mechanics.equilibrium import inflate
from freelearn.mechanics.loads import loads_at
from freelearn.mechanics.same_tubes import SameTubes
from freelearn.mechanics.tube import Tube
from freelearn.models.base import Bound, Model, Values
from freelearn.models.effect import Effect
from freelearn.models.material import Material
from freelearn.models.ports import EnergyEffect
from freelearn.models.prediction import Prediction, Status

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

    def energy(self, values: Values) -> EnergySum:
        """The wall's strain energy: the model's own terms, then those of the effects."""
        return EnergySum([*self.base_energy(self.own(values)), *(e.term(values) for e in self._energy)])

    def bare(self, states: States, values: Values) -> Prediction:
        """Loads of the tube in radial equilibrium; without one, those of a ballooned tube."""
        energy = self.energy(values)
        inflated = inflate(states, energy, self.points)
        status = torch.where(inflated.balanced, Status.OK, Status.NO_EQUILIBRIUM).to(torch.uint8)
        return Prediction(loads_at(inflated), status)

    def diameter(self, states: States, values: Values) -> Tensor:
        """As Chain.diameter: r_o² = r_i² + (R_o² − R_i²)/λz."""
        inflated = inflate(states, self.energy(values), self.points)
        return 2 * (inflated.u + Tube.from_states(states).solid).sqrt()

    def bind(self, states: States) -> Bound | None:
        """Without effects both parameters are logarithms of moduli, and the rest is made once."""
        # A class derived from this one may be another wall.
        plain = type(self) is Continuum and not self.effects
        return _BoundContinuum(states) if plain and states.bed.loads and not states.members else None


class _BoundContinuum:
    """The continuum at fixed states (see base.Bound)."""

    def __init__(self, states: States) -> None:
        self.tubes = SameTubes(states)

    def loads(self, vector: Tensor) -> Tensor:
        return self.tubes.loads(vector.exp())

    def jacobian(self, vector: Tensor) -> Tensor:
        return self.tubes.rates(vector.exp())
