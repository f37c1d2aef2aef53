"""What every effect must keep, on every model that it can join.

A user's own effect passes the same checks:

    from freelearn.testing.effects import EffectContract

    class TestLineLoss(EffectContract):
        effect = LineLoss
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any, ClassVar
from unittest.mock import patch

import torch
from torch import Tensor

from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.fitting.starts import starts
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import MODELS
from freelearn.testing.contract_checks import (
    batch_is_rows,
    factor,
    members_are_alone,
    parameter_derivatives,
    reciprocal,
    rescaled,
    state_derivatives,
)
from freelearn.testing.small_tables import recordings, visits

Kind = type[Effect[Any]]

# Near what fits the paper's samples, SI.
TRUTH: dict[str, dict[str, float]] = {
    "continuum": {"C1": 1e6, "C2": 4e7},
    "linear": {"ka": 8e3, "kb": 0.1, "kc": 3.0},
    "mlp": {},
}
# Ports whose effects store work and give it back.
CONSERVATIVE = ("boundary", "geometry", "energy")
# One standard deviation of the paper's load cells [N, N·m].
NOISE = (0.03, 6e-4)


def labels_of(effect: str | Kind, size: str) -> dict[str, float]:
    """Values of an effect's parameters, by their name in a model: at no effect ("none"), or at their scale."""
    kind = EFFECTS[effect] if isinstance(effect, str) else effect
    values = {}
    for p in kind.declared_parameters():
        assert p.scale is not None
        none = p.none if p.none is not None else p.start
        values[f"{kind.name}.{p.name}"] = none if size == "none" else float(p.scale)
    return values


def assemble(model: str, effects: Sequence[Kind], values: Mapping[str, float]) -> Model[Any]:
    """A model with effects of these classes, whether or not the registry knows them."""
    built = MODELS[model](effects=[effect() for effect in effects])
    built.set_values(values)
    return built


def network(model: Model[Any], states: States, loads: Tensor) -> Model[Any]:
    """The network with random weights and the scaling of these rows; its effects as they are."""
    rows = Rows.whole(states, loads)
    model.prepare(rows)
    effects = model.scalars()
    model.set_vector(starts(model, rows, 1, torch.Generator().manual_seed(3))[0])
    model.set_values(effects)
    return model


class EffectContract:
    """Derive from it and set `effect`; every test then runs on every family of models that the effect can join."""

    effect: ClassVar[Kind]
    # One family alone; blank for all of them.
    family: ClassVar[str] = ""
    # Constants of the effect's module that have a unit: name → unit.
    constants: ClassVar[Mapping[str, str]] = {}

    def families(self) -> list[str]:
        """Families that the tests run on."""
        return [self.family] if self.family else [name for name in TRUTH if name in self.effect.families()]

    def states(self) -> States:
        """The states that the tests look at: four pressures at each of four kinematic states of two samples; of an
        effect of the history a recording of each."""
        return States.from_table(recordings() if self.remembers else visits())

    @property
    def remembers(self) -> bool:
        """Whether it is an effect of the history."""
        return self.effect.port == "history"

    def build(
        self,
        family: str,
        effects: Sequence[Kind],
        values: Mapping[str, float],
        states: States | None = None,
        units: Tensor | None = None,
    ) -> Model[Any]:
        """The family's model with effects; units: sizes of the units of load, for the network's scaling."""
        model = assemble(family, effects, TRUTH[family] | dict(values))
        if family == "mlp":
            states = self.states() if states is None else states
            spread = torch.linspace(-1, 1, 2 * len(states), dtype=torch.float64).sin().reshape(-1, 2)
            size = torch.tensor([30.0, 0.2], dtype=torch.float64)
            model = network(model, states, spread * (size if units is None else size * units))
        return model

    def models(self, size: str = "scale") -> list[Model[Any]]:
        """A model of each family with the effect."""
        return [self.build(family, [self.effect], labels_of(self.effect, size)) for family in self.families()]

    # --- tests ----------------------------------------------------------------------------------------------

    def test_it_is_a_proper_effect(self) -> None:
        """It has a name, says when to suspect it and where it is described, and its parameters a scale."""
        assert self.effect.problem() is None
        assert self.effect.name.isidentifier()
        assert self.effect.suspect
        assert self.families()

    def test_without_effect_the_loads_are_the_bare_models_to_the_last_bit(self) -> None:
        """No effect is no effect. With one more energy the same equilibrium is found by other steps: to rounding."""
        states = self.states()
        for family, model in zip(self.families(), self.models("none"), strict=True):
            loads, bare = model(states).loads, self.build(family, [], {})(states).loads
            if self.effect.port == "energy":
                torch.testing.assert_close(loads, bare, rtol=1e-12, atol=1e-13)
            else:
                assert torch.equal(loads, bare)

    def test_at_its_scale_it_shows_above_the_noise_and_stays_finite(self) -> None:
        """The declared scale is a noticeable effect."""
        states, noise = self.states(), torch.tensor(NOISE, dtype=torch.float64)
        for family, model in zip(self.families(), self.models(), strict=True):
            before, after = self.build(family, [], {})(states), model(states)
            assert after.loads.isfinite().all()
            assert ((after.loads - before.loads).abs().amax(0) > 2 * noise).any()

    def test_derivatives_by_parameters_are_those_of_differences(self) -> None:
        """By automatic differentiation forward and backward, and by differences."""
        parameters = self.effect.declared_parameters()
        steps = {f"{self.effect.name}.{p.name}": 1e-4 if p.log else 1e-4 * float(p.scale or 1) for p in parameters}
        for model in self.models():
            parameter_derivatives(model, self.states(), steps)

    def test_derivatives_by_the_state_are_those_of_differences(self) -> None:
        """By length, twist and pressure."""
        states = self.states()
        for model in self.models():
            state_derivatives(model, states)

    def test_a_batch_is_its_rows(self) -> None:
        """No row's loads depend on another row."""
        for model in self.models():
            batch_is_rows(model, self.states())

    def test_several_members_at_once_are_one_after_the_other(self) -> None:
        """As restarts and the rows of a Jacobian are computed."""
        for model in self.models():
            members_are_alone(model, self.states())

    def test_the_physics_does_not_depend_on_the_units(self) -> None:
        """With every parameter in other units of length, force and time, the loads come out in those units."""
        states = self.states()
        other, units = rescaled(states), torch.tensor([factor("N"), factor("N·m")], dtype=torch.float64)
        for family, model in zip(self.families(), self.models(), strict=True):
            values = {n: v * factor(model.declared[n].unit) for n, v in model.scalars().items()}
            changed = self.build(family, [self.effect], values, other, units)
            expected = model(states).loads * units
            with self._constants():
                torch.testing.assert_close(changed(other).loads, expected, rtol=1e-8, atol=1e-9)

    def _constants(self) -> AbstractContextManager[Any]:
        """The constants of the effect's module in the new units."""
        module = sys.modules[self.effect.__module__]
        changed = {name: getattr(module, name) * factor(unit) for name, unit in self.constants.items()}
        return patch.multiple(module, **changed) if changed else nullcontext()

    def test_joins_every_other_effect(self) -> None:
        """Any two together give finite loads."""
        states = self.states()[slice(2, None, 5)]
        for family in self.families():
            for name, other in EFFECTS.items():
                # Each pair of the library once.
                if name == self.effect.name or (self.effect.name in EFFECTS and name < self.effect.name):
                    continue
                if family in other.families():
                    values = labels_of(self.effect, "scale") | labels_of(other, "scale")
                    model = self.build(family, [self.effect, other], values)
                    with torch.no_grad():
                        assert model(states).loads.isfinite().all(), name

    def test_conservative_effects_keep_reciprocity(self) -> None:
        """∂F/∂φ = ∂M/∂l at fixed pressure, on models that have it."""
        if self.effect.port in CONSERVATIVE:
            for model in self.models():
                if model.conservative:
                    reciprocal(model, self.states())
