"""The continuum model and what it leaves: a potential learned at each design, and hysteresis carried to its like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.model import Bound, Values
from freelearn.physics.chain.prediction import Prediction
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.models.hybrid_shapes import (
    FADES,
    GONE,
    PRESSURE_FADES,
    PRESSURE_GONE,
    alike,
    coordinates,
    designs,
    distances,
    ending,
    held,
    load_scale,
    middle_radius,
)

# Buffers of D designs with B centers each, and their shapes before a fit.
SHAPES: dict[str, tuple[int, ...]] = {
    "design": (0, 5),  # in the coordinates of hybrid_shapes.designs
    "reach": (0,),  # distance from it at which its potential has ended
    "middle": (0, 3),  # of the box of its data, in those of hybrid_shapes.coordinates
    "extent": (0, 3),
    "center": (0, 0, 3),  # in units of the box
    "spread": (0, 3),
    "amplitude": (0, 0),  # J
    "level": (0,),  # J, so that the potential's mean over the data is zero
    "sensors": (0, 2, 2),  # what the sensors show of the loads beside them: gains, 1/m and m across
    "rubbed": (0, 2),  # N, N·m
    "size": (0, 2),  # of the design's loads, N, N·m
    "weigher": (0, 0),  # inverse of the designs' correlations
    "carried": (),  # share of what is rubbed that is taken for common to like designs
    "moduli": (2,),  # C1, C2 of the fit, Pa
    "box": (2, 3),  # middle and half of the box of all data
}


class Hybrid(Continuum):
    """Loads of the continuum model + those of a remainder, which is zero before a fit and away from its data.

    F = F_c − ∂Π/∂l − s r_F, M = M_c − ∂Π/∂φ − s r_M, s the direction of the pressure. Π(l, φ, P) is one scalar: what is
    added to the continuum keeps reciprocity at fixed pressure, and gives back on a closed path what it took. It belongs
    to the design it was learned from alone. r is hysteresis (it takes work), in units of a design's loads, of which a
    share is carried to like designs. C1, C2 are those of the continuum model; fit.remainder learns the rest.
    """

    name = "hybrid"
    # Its potential is; what sensors show beside the loads need not be.
    conservative = False
    # Where the actuator rests the table may be off its zero: that is learned too.
    relaxed_at_rest = False

    design: Tensor
    reach: Tensor
    middle: Tensor
    extent: Tensor
    center: Tensor
    spread: Tensor
    amplitude: Tensor
    level: Tensor
    sensors: Tensor
    rubbed: Tensor
    size: Tensor
    weigher: Tensor
    carried: Tensor
    moduli: Tensor
    box: Tensor

    def __init__(self, C1: float = 1e5, C2: float = 1e6, effects: Sequence[Effect[Any]] = ()) -> None:
        """As Continuum. Raises UserError."""
        super().__init__(C1, C2, effects)
        for name, shape in SHAPES.items():
            self.register_buffer(name, torch.zeros(shape, dtype=torch.float64))

    def prepare(self, rows: Rows) -> None:
        """Forgets a remainder that was learned before. Raises UserError where nothing could tell one."""
        bed = rows.states.bed
        if not bed.loads or rows.states.members:
            what = "several actuators on one end block" if rows.states.members else f"the bed {bed.name}"
            raise UserError(
                f"Model hybrid learns from force and moment of one actuator at imposed states, which {what} does not "
                "tell: use model=continuum."
            )
        self.clear()

    def clear(self) -> None:
        """Forgets the remainder."""
        self.take({name: torch.zeros(shape, dtype=torch.float64) for name, shape in SHAPES.items()})

    def take(self, remainder: Mapping[str, Tensor]) -> None:
        """Takes over a remainder: buffers by name."""
        for name, tensor in remainder.items():
            setattr(self, name, tensor.detach().clone())

    @property
    def learned(self) -> bool:
        """Whether there is a remainder."""
        return len(self.design) > 0

    @property
    def coefficients(self) -> int:
        """Amplitudes, gains and hysteresis of the remainder."""
        return sum(part.numel() for part in (self.amplitude, self.sensors, self.rubbed))

    def _load_from_state_dict(self, state: Mapping[str, Any], prefix: str, *rest: Any) -> None:
        """How many designs and centers there are is the checkpoint's."""
        for name in SHAPES:
            if prefix + name in state:
                setattr(self, name, torch.zeros_like(state[prefix + name]))
        super()._load_from_state_dict(state, prefix, *rest)

    def ideal(self, states: States, values: Values) -> Prediction:
        """As Chain.ideal, with the remainder's potential, which knows an actuator by its nominal design."""
        found = super().ideal(states, values)
        if not self.learned:
            return found
        return found.with_loads(found.loads + self.potential_loads(states) + self.shown(found.loads, states))

    def dissipated(self, loads: Tensor, states: States, values: Values) -> Tensor:
        """As Chain.dissipated, with the remainder's hysteresis."""
        if self.learned:
            loads = loads - states.direction[:, None] * self.hysteresis(states)
        return super().dissipated(loads, states, values)

    def potential_loads(self, states: States) -> Tensor:
        """−∂Π/∂l, −∂Π/∂φ: (N, 2) N, N·m."""
        place, weight = self.at(states)
        z = self._boxed(states, place)
        height, slopes = potential_parts(z, self.center[place], self.spread[place])
        amplitude = self.amplitude[place]
        stored = (height * amplitude).sum(-1) - self.level[place]
        by_place = (slopes * amplitude[..., None]).sum(-2)
        window, rate = ending(z[:, :2], FADES, GONE)
        by_place = by_place * window.prod(-1, keepdim=True) + stored[:, None] * rate * window.flip(-1)
        within = ending(z[:, 2], PRESSURE_FADES, PRESSURE_GONE)[0] * weight
        return -by_place / self.extent[place][:, :2] * arms(states) * within[:, None]

    def shown(self, loads: Tensor, states: States) -> Tensor:
        """What sensors show beside the continuum's loads (N, 2), by their gains and cross-talk: (N, 2) N, N·m."""
        place, weight = self.at(states)
        beside = (self.sensors[place] @ loads[..., None])[..., 0]
        return beside * (weight * windowed(self._boxed(states, place)))[:, None]

    def _boxed(self, states: States, place: Tensor) -> Tensor:
        """The states in units of the box of the nearest design's data, (N, 3)."""
        return (coordinates(states, self.moduli[0]) - self.middle[place]) / self.extent[place]

    def at(self, states: States) -> tuple[Tensor, Tensor]:
        """The nearest design (N,) int64, and how much of its potential reaches a row's, (N,)."""
        far = distances(designs(states), self.design)
        place = far.detach().argmin(-1)
        near = far.gather(-1, place[:, None])[:, 0]
        return place, ending(near / self.reach[place], 0.5, 1.0)[0]

    def hysteresis(self, states: States) -> Tensor:
        """Loads that rising pressure loses and falling pressure gains, (N, 2) N, N·m.

        A design is told by those learned from, by the weights of a Gaussian process, either with the same load or with
        the same share of its own loads: whichever is less.
        """
        weights = alikeness(distances(designs(states), self.design), self.reach, self.carried) @ self.weigher
        own = load_scale(states, self.moduli, self.box[1])
        told = self.rubbed * (own[:, None] / self.size).clamp(max=1.0)
        z = (coordinates(states, self.moduli[0]) - self.box[0]) / self.box[1]
        return (weights[..., None] * told).sum(1) * windowed(z)[:, None]

    def remarks(self) -> list[str]:
        """As Model.remarks."""
        if not self.learned:
            return []
        return [
            f"The remainder of {self.coefficients} coefficients was learned at {len(self.design)} "
            f"design{'s' * (len(self.design) > 1)}; C1 and C2, and "
            "their standard errors, are those of the continuum model beside it."
        ]

    def bind(self, states: States) -> Bound | None:
        """As Continuum.bind, while there is no remainder."""
        if type(self) is not Hybrid or self.learned or self.effects or states.members:
            return None
        return Continuum().bind(states)


def alikeness(far: Tensor, reach: Tensor, carried: Tensor) -> Tensor:
    """Correlation of what is rubbed at designs this far from those learned, (N, D): of it a share is common to like
    designs, and the rest each design's own."""
    return carried * alike(far) + (1 - carried) * ending(far / reach, 0.5, 1.0)[0]


def windowed(z: Tensor) -> Tensor:
    """1 in and around a box of data, 0 away from it; z: (N, 3) in units of the box."""
    place, _ = ending(z[:, :2], FADES, GONE)
    return place.prod(-1) * ending(z[:, 2], PRESSURE_FADES, PRESSURE_GONE)[0]


def potential_parts(z: Tensor, center: Tensor, spread: Tensor) -> tuple[Tensor, Tensor]:
    """Gaussian functions (N, B) of N states in units of their box (N, 3), and their slopes by the first two (N, B, 2).

    center: (N, B, 3) or (B, 3); spread: (N, 3) or (3,)."""
    kept, slope = held(z)
    away = (kept[:, None] - center) / spread.unsqueeze(-2)
    height = (-away.square().sum(-1) / 2).exp()
    by_place = -height[..., None] * (away / spread.unsqueeze(-2) * slope[:, None])[..., :2]
    return height, by_place


def arms(states: States) -> Tensor:
    """∂stretch/∂l and ∂shear/∂φ, (N, 2) 1/m, 1."""
    return torch.stack([1 / states.reference_length, middle_radius(states) / states.reference_length], dim=-1)
