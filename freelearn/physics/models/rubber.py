"""The rubber of the tube's wall, cut out and tested alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.recordings import Recording
from freelearn.physics.chain.model import Values
from freelearn.physics.chain.ports import EnergyEffect
from freelearn.physics.effects.registry import EFFECTS, make_effects
from freelearn.physics.mechanics.energy import Energy, NeoHookean, nominal_stress
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.models.relaxation import Relaxation

ISOTROPIC = ("i1", "i2")
# Where a search has taken a logarithm beyond all numbers, the value is zero; it begins again with this.
TINY = 1e-300


class Rubber:
    """Ψ = C1/2 (I₁ − 3) + the strain energies of effects: the continuum model's wall without its fiber.

    effects: names. relaxation: of recordings; tests without a time were slow, and show the stress at rest. declared:
    the parameters by name, as in the continuum model (C1, wall_stiffening.C20, …), then those of the relaxation. A fit
    moves a vector of raw parameters (p,) in their order. Raises UserError for an effect that rubber alone cannot show.
    """

    def __init__(self, effects: Sequence[str] = (), relaxation: Relaxation | None = None) -> None:
        self.effects = _isotropic(effects)
        self.relaxation = relaxation or Relaxation()
        declared = Continuum(effects=self.effects).declared
        self.declared = {name: p for name, p in declared.items() if name != "C2"} | self.relaxation.declared

    def physical(self, vector: Tensor) -> Values:
        """Parameters in SI from a raw vector (p,), differentiable."""
        return {name: p.to_physical(vector[i]) for i, (name, p) in enumerate(self.declared.items())}

    def raw(self, values: dict[str, float]) -> Tensor:
        """The raw vector (p,) of parameters given in SI."""
        raw = [p.to_raw(max(values[name], TINY) if p.log else values[name]) for name, p in self.declared.items()]
        return torch.stack(raw)

    def bounds(self) -> tuple[Tensor, Tensor]:
        """Lower and upper bounds of the raw vector, each (p,)."""
        pairs = torch.tensor([p.raw_bounds for p in self.declared.values()], dtype=torch.float64)
        return pairs[:, 0], pairs[:, 1]

    def energy(self, values: Values) -> list[Energy]:
        """The terms of the strain energy."""
        # The fiber's C2 is a number that effects may ask for; isotropic ones do not use it.
        material = values | {"C2": torch.zeros_like(values["C1"])}
        return [NeoHookean(values["C1"]), *(effect.term(material) for effect in self.effects)]

    def stress(self, values: Values, along: Tensor, across: Tensor) -> Tensor:
        """Nominal stress in a direction of a sheet: the stretches along and across it, each (N,) → (N,) Pa."""
        return nominal_stress(self.energy(values), along, across)

    def relaxing(
        self, values: Values, along: Tensor, across: Tensor, sheared: Tensor, recording: Recording[Tensor]
    ) -> Tensor:
        """As stress, along recordings, (M,) Pa; in simple shear the shear stress. sheared: where, (M,) bool."""
        work = torch.where(sheared, per_shear(along), 1.0)
        arms = work * nominal_stress([self.relaxation.energy(values)], along, across)
        return work * self.stress(values, along, across) + self.relaxation.overstress(values, arms, recording)


def per_shear(stretch: Tensor) -> Tensor:
    """dλ/dγ of the larger principal stretch by the amount of shear γ = λ − 1/λ, (N,) → (N,): what P dλ spends the shear
    stress spends as τ dγ."""
    return 1 / (1 + stretch**-2)


def isotropic_effects() -> list[str]:
    """Names of the effects that add a strain energy of I₁ and I₂ alone, all through the wall."""
    return [name for name, effect in EFFECTS.items() if issubclass(effect, EnergyEffect) and _of_the_rubber(effect)]


def _of_the_rubber(effect: type[EnergyEffect[Any]]) -> bool:
    return set(effect.depends_on) <= set(ISOTROPIC) and not effect.at_bore and not effect.compares


def _isotropic(names: Sequence[str]) -> list[EnergyEffect[Any]]:
    effects: list[EnergyEffect[Any]] = []
    possible = ", ".join(isotropic_effects())
    for effect in make_effects(names, "continuum"):
        if not isinstance(effect, EnergyEffect):
            raise UserError(
                f"Effect {effect.name!r} adds no strain energy, so a rubber specimen cannot show it: "
                f"leave it out here and give it to train.py. Possible are {possible}."
            )
        if not set(effect.depends_on) <= set(ISOTROPIC):
            raise UserError(
                f"Effect {effect.name!r} depends on the fiber, and a rubber specimen has none: "
                f"leave it out here and give it to train.py. Possible are {possible}."
            )
        if effect.at_bore:
            raise UserError(
                f"Effect {effect.name!r} acts at a tube's bore, and a rubber specimen has none: "
                f"leave it out here and give it to train.py. Possible are {possible}."
            )
        if effect.compares:
            raise UserError(
                f"Effect {effect.name!r} compares actuators with each other, and a rubber specimen is alone: "
                f"leave it out here and give it to train.py. Possible are {possible}."
            )
        effects.append(effect)
    return effects
