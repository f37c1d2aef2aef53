"""What every model must keep, the library's and a user's own:

from freelearn.testing.models import ModelContract

class TestBraidedMuscle(ModelContract):
    model = BraidedMuscle
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import torch

from freelearn.data.states import States
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import MODELS, check_model, load_model, register_model, save_checkpoint
from freelearn.testing.contract_checks import (
    batch_is_rows,
    factor,
    members_are_alone,
    parameter_derivatives,
    reciprocal,
    rescaled,
    state_derivatives,
)
from freelearn.testing.effects import labels_of
from freelearn.testing.small_tables import visits


class ModelContract:
    """Derive from it and set `model`, and `values` where its start values are far from what it models."""

    model: ClassVar[type[Model[Any]]]
    # Values of its parameters, SI.
    values: ClassVar[Mapping[str, float]] = {}

    def states(self) -> States:
        """The states that the tests look at: four pressures at each of four kinematic states of two samples."""
        return States.from_table(visits())

    def build(self, effects: tuple[str, ...] = (), values: Mapping[str, float] | None = None) -> Model[Any]:
        """The model with effects of the library at their scale."""
        built = self.model(effects=[EFFECTS[name]() for name in effects])
        sizes = {label: value for name in effects for label, value in labels_of(name, "scale").items()}
        built.set_values(dict(self.values) | sizes | dict(values or {}))
        return built

    # --- tests ----------------------------------------------------------------------------------------------

    def test_every_row_gets_two_finite_loads_and_a_status(self) -> None:
        """In double precision, whatever the number of rows."""
        model = self.build()
        check_model(model, self.states())
        for count in (1, 3, len(self.states())):
            loads, status = model(self.states()[slice(0, count)])
            assert loads.shape == (count, 2)
            assert loads.dtype == torch.float64
            assert loads.isfinite().all()
            assert status.shape == (count,)
            assert status.dtype == torch.uint8
            assert set(status.tolist()) <= {int(s) for s in Status}

    def test_a_batch_is_its_rows(self) -> None:
        """No row's loads depend on another row."""
        batch_is_rows(self.build(), self.states())

    def test_derivatives_by_parameters_are_those_of_differences(self) -> None:
        """By automatic differentiation forward and backward, and by differences."""
        model = self.build()
        if len(model.vector()):
            vector = dict(zip(model.labels(), model.vector().tolist(), strict=True))
            steps = {name: 1e-4 * max(abs(vector[name]), 1e-3) for name in model.declared}
            parameter_derivatives(model, self.states(), steps)

    def test_derivatives_by_the_state_are_those_of_differences(self) -> None:
        """By length, twist and pressure."""
        state_derivatives(self.build(), self.states())

    def test_several_members_at_once_are_one_after_the_other(self) -> None:
        """As restarts and the rows of a Jacobian are computed."""
        if len(self.build().vector()):
            members_are_alone(self.build(), self.states())

    def test_a_conservative_model_keeps_reciprocity(self) -> None:
        """∂F/∂φ = ∂M/∂l at fixed pressure, where the model says that it is conservative."""
        if self.model.conservative:
            reciprocal(self.build(), self.states())

    def test_the_unloaded_actuator_carries_nothing(self) -> None:
        """At its reference length, untwisted and without pressure, where the model says so."""
        if self.model.relaxed_at_rest:
            states = self.states()
            zero = torch.zeros_like(states.length)
            rest = states.replace(length=states.reference_length, twist=zero, pressure=zero)
            loads = self.build()(rest).loads
            torch.testing.assert_close(loads, torch.zeros_like(loads), rtol=0, atol=1e-8)

    def test_the_physics_does_not_depend_on_the_units(self) -> None:
        """With every parameter in other units of length, force and time, the loads come out in those units."""
        model, states = self.build(), self.states()
        if model.weights:
            return
        units = torch.tensor([factor("N"), factor("N·m")], dtype=torch.float64)
        values = {n: v * factor(model.declared[n].unit) for n, v in model.scalars().items()}
        changed = self.build(values=values)
        torch.testing.assert_close(changed(rescaled(states)).loads, model(states).loads * units, rtol=1e-8, atol=1e-9)

    def test_every_effect_of_its_family_joins(self) -> None:
        """Each at its scale gives finite loads."""
        states = self.states()
        for name, effect in EFFECTS.items():
            if self.model.family in effect.families():
                with torch.no_grad():
                    assert self.build((name,))(states).loads.isfinite().all(), name

    def test_a_checkpoint_brings_it_back(self) -> None:
        """Saved and loaded by name, with an effect, it gives the same loads to the last bit."""
        model = self.build(("force_gain",))
        with tempfile.TemporaryDirectory() as folder, _known(self.model):
            save_checkpoint(model, Path(folder) / "checkpoint.ckpt")
            again = load_model(Path(folder) / "checkpoint.ckpt")
        assert torch.equal(again(self.states()).loads, model(self.states()).loads)


@contextmanager
def _known(model: type[Model[Any]]) -> Iterator[None]:
    """The model under its name, for as long as this lasts."""
    new = model.name not in MODELS
    if new:
        register_model(model)
    try:
        yield
    finally:
        if new:
            del MODELS[model.name]
