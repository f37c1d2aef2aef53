"""The continuum model with one part of its nonlinearity taken out, to learn which part matters.

The paper leaves this ablation as future work. Each variant keeps everything else of the continuum model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from freelearn.measurements.error import load_scale
from freelearn.measurements.states import States
from freelearn.mechanics.energy import EnergySum, NeoHookean, StandardFiber
from freelearn.mechanics.linear_material import LinearMaterial
from freelearn.mechanics.loads import tube_loads
from freelearn.mechanics.tube import Tube
from freelearn.models.base import Model, Values
from freelearn.models.continuum import Continuum
from freelearn.models.parameter import Parameter
from freelearn.models.ports import Effect, columns
from freelearn.models.prediction import Prediction, Status

# Smallest and largest shear modulus of a start [Pa].
START_RANGE = (1e3, 1e9)
# A fibre helix turned to within this share of its own angle counts as parallel to the axis.
SINGULAR_SHARE = 0.02


class ContinuumLinearMaterial(Continuum):
    """Linear material, nonlinear deformation: Hooke's law in the finite strain instead of the neo-Hookean wall."""

    name = "continuum_linear_material"
    family = "continuum"

    def energy(self, values: Values) -> EnergySum:
        """The wall's strain energy, with Hooke's law in place of the neo-Hookean term."""
        base = [LinearMaterial(values["C1"]), StandardFiber(values["C2"])]
        return EnergySum([*base, *self.effect_terms(values)])


class ContinuumThinWall(Continuum):
    """Thin wall: the stresses of the middle surface stand for the whole wall (one quadrature point)."""

    name = "continuum_thin_wall"
    family = "continuum"
    points = 1


class ContinuumInextensible(Model):
    """Inextensible fibre: a neo-Hookean thick wall, held by a helix on its outer surface that cannot stretch.

    I₄(R_o) = 1 fixes the outer radius, r_o² = (1 − λz² cos²Γ)/(sin Γ/R_o + k cos Γ)², and incompressibility the inner
    one. The pressure that the wall does not carry is carried by the fibre's tension, which also pulls and turns.
    The fluid's part of the loads is that of the linear model.
    """

    name = "continuum_inextensible"

    def __init__(self, C1: float = 1e5, effects: Sequence[Effect] = ()) -> None:
        super().__init__([Parameter("C1", "C₁", "Pa", start=1e5, lower=0.0, log=True)], effects)
        self.set_values({"C1": C1})

    def structure(self, states: States, values: Values) -> Prediction:
        tube = Tube.from_states(states)
        wall = EnergySum([NeoHookean(values["C1"])]).wall(tube)
        axial, smallest = tube.axial * tube.cosine, 1e-2 * states.inner_radius**2
        own = torch.sin(states.fiber_angle) / states.outer_radius
        hoop = own + tube.fiber_turn
        singular = hoop.abs() < SINGULAR_SHARE * own
        hoop = torch.where(singular, SINGULAR_SHARE * own, hoop)
        radius2 = (1 - axial * axial) / hoop**2
        # A fibre that is too short for the length would have to close the bore: the row is marked, and a finite number
        # keeps it from breaking a loss that it is not part of.
        overstretched = radius2 - tube.solid < smallest
        u = torch.where(overstretched, smallest, radius2 - tube.solid)
        tension = (states.pressure - wall.carried(u).pressure) / hoop**2
        radius2 = u + tube.solid
        force = -math.pi * tension * (2 * axial * axial - radius2 * hoop**2)
        moment = -2 * math.pi * tension * (radius2 * hoop * axial)
        status = torch.where(overstretched, Status.OVERSTRETCHED, Status.OK)
        status = torch.where(singular, Status.SINGULAR, status).to(torch.uint8)
        return Prediction(tube_loads(wall, u) + columns(force, moment), status)

    def starts(self, states: States, loads: Tensor, members: int, generator: torch.Generator) -> Tensor:
        """The best C1 for the present effects: the loads are linear in it."""
        scale = load_scale(loads)
        values = {name: value.detach() for name, value in self.values().items()}

        def scaled(C1: float) -> Tensor:
            predicted = self(states, values | {"C1": torch.tensor(C1, dtype=torch.float64)})
            return (predicted.loads / scale)[predicted.status == Status.OK].reshape(-1)

        with torch.no_grad():
            usable = self(states).status == Status.OK
            offset = scaled(0.0)
            column = (scaled(1e6) - offset) / 1e6
            target = (loads / scale)[usable].reshape(-1) - offset
            best = float((column @ target) / column.square().sum().clamp_min(1e-300))
        raw = self.to_raw(self.scalars() | {"C1": min(max(best, START_RANGE[0]), START_RANGE[1])})
        return torch.stack([raw[name] for name in self.declared]).expand(members, -1).clone()
