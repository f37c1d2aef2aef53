"""The paper's continuum model: a thick incompressible rubber tube with an extensible helical fibre."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from freelearn.measurements.states import States
from freelearn.mechanics.energy import Energy, EnergySum, NeoHookean, StandardFiber
from freelearn.mechanics.equilibrium import inflate
from freelearn.mechanics.loads import loads_at
from freelearn.mechanics.same_tubes import SameTubes
from freelearn.models.base import Bound, Model, Values
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect
from freelearn.models.prediction import Prediction, Status

# What the paper fixes for the constituents (Sedal et al. 2018) [Pa].
CONSTITUENT = {"C1": 5e5, "C2": 1e6}

# Where a fit looks for its start: C1 and C2 on this grid [Pa], on at most this many rows.
START_DECADES = torch.linspace(4, 8, 9, dtype=torch.float64)
START_ROWS = 64


class Continuum(Model):
    """Ψ = C1/2 (I₁ − 3) + C2/2 (I₄ − 1)², thick wall in radial equilibrium with the pressure.

    C1: shear modulus of the wall [Pa]; C2: stiffness of the fibre per wall volume [Pa]; both positive, fitted as
    logarithms. Source: the paper's Section "Nonlinear Continuum Model"; Sedal et al. 2018.
    """

    name = "continuum"
    # Quadrature points through the wall; None integrates in closed form where an energy has one.
    points: int | None = None

    def __init__(self, C1: float = 1e5, C2: float = 1e6, effects: Sequence[Effect] = ()) -> None:
        declared = [
            Parameter("C1", "C₁", "Pa", start=1e5, lower=0.0, log=True, source="Sedal et al. 2018"),
            Parameter("C2", "C₂", "Pa", start=1e6, lower=0.0, log=True, source="Sedal et al. 2018"),
        ]
        super().__init__(declared, effects)
        self.set_values({"C1": C1, "C2": C2})

    def energy(self, values: Values) -> EnergySum:
        """The wall's strain energy: the paper's two terms, then those of the effects."""
        base = [NeoHookean(values["C1"]), StandardFiber(values["C2"])]
        return EnergySum([*base, *self.effect_terms(values)])

    def effect_terms(self, values: Values) -> list[Energy]:
        """The energies that the effects add."""
        return [term for e in self.effects for term in e.energy_terms(values)]

    def structure(self, states: States, values: Values) -> Prediction:
        energy = self.energy(values)
        inflated = inflate(states, energy, self.points)
        status = torch.where(inflated.balanced, Status.OK, Status.NO_EQUILIBRIUM).to(torch.uint8)
        return Prediction(loads_at(inflated), status)

    def bind(self, states: States) -> Bound | None:
        """Without effects both parameters are logarithms of moduli, and the rest is made once."""
        exact = type(self).energy is Continuum.energy and not self.points and not self.effects
        return _BoundContinuum(states) if exact else None

    def starts(self, states: States, loads: Tensor, members: int, generator: torch.Generator) -> Tensor:
        """The model's own values and a coarse grid of C1 × C2, the best first.

        A fit therefore does not depend on where its user started.
        """
        here = self.vector().detach()
        grid = torch.cartesian_prod(START_DECADES, START_DECADES) * torch.log(torch.tensor(10.0, dtype=torch.float64))
        candidates = torch.cat([here[None], here.expand(len(grid), -1)])
        names = list(self.declared)
        candidates[1:, [names.index("C1"), names.index("C2")]] = grid
        some = slice(None, None, max(1, len(states) // START_ROWS))
        states, loads = states[some], loads[some]
        scale = loads.abs().amax(0)
        # All candidates in one batch: every row once for each, with the candidate's values.
        row = torch.arange(len(states)).repeat(len(candidates))
        values = self.physical(candidates.repeat_interleave(len(states), dim=0))
        with torch.no_grad():
            predicted = self.chain(states[row], values).loads
        costs = ((predicted - loads[row]) / scale).square().reshape(len(candidates), -1).sum(-1)
        return candidates[costs.nan_to_num(nan=torch.inf).argsort()[:members]]


class _BoundContinuum:
    """The continuum at fixed states (see base.Bound)."""

    def __init__(self, states: States) -> None:
        self.tubes = SameTubes(states)

    def loads(self, vector: Tensor) -> Tensor:
        return self.tubes.loads(vector.exp())

    def jacobian(self, vector: Tensor) -> Tensor:
        return self.tubes.rates(vector.exp())
