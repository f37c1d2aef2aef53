"""An effect: physics that a model leaves out, as a part that plugs into one stop of the chain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.mechanics.energy import Energy
from freelearn.models.parameter import Parameter


class Effect:
    """Base of all effects. A subclass declares its name, parameters and models, and overrides one of five methods.

    boundary: `impose` changes the state that was really imposed; geometry: `reshape` changes the actuator's
    design; energy: `psi` adds a strain energy; dissipation: `dissipate` and measurement: `sense` change the loads.
    Each gets `p`, its own parameters by name in SI. With every parameter at its no-effect value the model is
    unchanged.
    """

    name: ClassVar[str]
    parameters: ClassVar[Sequence[Parameter]] = ()
    models: ClassVar[tuple[str, ...]] = ("continuum", "linear", "mlp")
    # Invariants that `psi` takes.
    depends_on: ClassVar[tuple[str, ...]] = ()

    def own(self, values: Mapping[str, Tensor]) -> SimpleNamespace:
        """This effect's parameters out of the model's values."""
        return SimpleNamespace(**{p.name: values[f"{self.name}.{p.name}"] for p in self.parameters})

    def impose(self, states: States, p: Any) -> States:
        return states

    def reshape(self, states: States, p: Any) -> States:
        return states

    def dissipate(self, loads: Tensor, states: States, p: Any) -> Tensor:
        return loads

    def sense(self, loads: Tensor, states: States, p: Any) -> Tensor:
        return loads

    def psi(self, *invariants: Tensor, p: Any, material: Mapping[str, Tensor]) -> Tensor:
        """Added strain energy [Pa] at the invariants of `depends_on`; material: the model's own C1, C2."""
        raise NotImplementedError

    def energy_terms(self, values: Mapping[str, Tensor]) -> list[Energy]:
        """The strain energies that the effect adds, as mechanics sees them."""
        if not self.depends_on:
            return []
        material = {name: values[name] for name in ("C1", "C2")}
        return [EffectEnergy(self, self.own(values), material)]


@dataclass(frozen=True)
class EffectEnergy(Energy):
    """An effect's `psi` with its parameters filled in."""

    effect: Effect
    p: SimpleNamespace
    material: Mapping[str, Tensor]

    @property
    def depends_on(self) -> tuple[str, ...]:  # type: ignore[override]
        return self.effect.depends_on

    def psi(self, *invariants: Tensor) -> Tensor:
        return self.effect.psi(*invariants, p=self.p, material=self.material)

    def detach(self) -> EffectEnergy:
        still = SimpleNamespace(**{name: value.detach() for name, value in vars(self.p).items()})
        return EffectEnergy(self.effect, still, {n: v.detach() for n, v in self.material.items()})


def columns(force: Tensor, moment: Tensor) -> Tensor:
    """Loads (N, 2) from force [N] and moment [N·m], each scalar or (N,)."""
    return torch.stack(torch.broadcast_tensors(force, moment), dim=-1)
