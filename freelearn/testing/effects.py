"""What every effect must keep, on every model that it can join. `test_contract` runs it for the whole library.

A user's own effect passes the same checks: derive a class from EffectContract that says `effect` and `family`.
"""

import numpy as np
import pandas as pd
import torch

from freelearn.bed.virtual import DESIGNS
from freelearn.fit.problem import Problem
from freelearn.fit.starts import starts
from freelearn.inference.noise import sensitivities
from freelearn.measurements.rows import Rows
from freelearn.measurements.states import States
from freelearn.models.base import Model
from freelearn.models.build import build_model
from freelearn.models.effects.registry import EFFECTS
from freelearn.models.prediction import Status

# Near what fits the paper's samples, SI.
TRUTH = {
    "continuum": {"C1": 1e6, "C2": 4e7},
    "linear": {"ka": 8e3, "kb": 0.1, "kc": 3.0},
    "mlp": {},
}
CONSERVATIVE = ("boundary", "geometry", "energy")
# Exponents of length, force and time in the units that effects use.
UNITS = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "m": (1, 0, 0),
    "s": (0, 0, 1),
    "N": (0, 1, 0),
    "N·m": (1, 1, 0),
    "Pa": (-2, 1, 0),
    "m/N": (1, -1, 0),
    "rad/(N·m)": (-1, -1, 0),
    "N/(N·m)": (-1, 0, 0),
    "N·m/N": (1, 0, 0),
    "N/s": (0, 1, -1),
    "N·m/s": (1, 1, -1),
    "N/m": (-1, 1, 0),
    "N·m/rad": (1, 1, 0),
    "N/rad": (0, 1, 0),
}


def visits(count: int = 4, seed: int = 0, samples: tuple[int, ...] = (3, 5)) -> pd.DataFrame:
    """Kinematic states at random places of the samples, with three pressures up and one down.

    The rows of a state are half a minute apart, the states an hour.
    """
    generator = np.random.default_rng(seed)
    rows: list[tuple[float, ...]] = []
    for sample in samples:
        gamma, length, inner, outer = DESIGNS[sample - 1]
        for _ in range(count):
            place = generator.uniform(-4, 3), generator.choice([-1, 1]) * generator.uniform(15, 110)
            for step, pressure in enumerate((0.0, 35.0, 70.0, 30.0)):
                rows.append(
                    (
                        sample,
                        gamma,
                        length,
                        inner,
                        outer,
                        step,
                        *place,
                        pressure,
                        30.0 * step + 900.0 * (len(rows) - step),
                    )
                )
    head = ["sample", "gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm", "step", "elongation_mm"]
    return pd.DataFrame(rows, columns=[*head, "twist_deg", "pressure_kpa", "time_s"])


def labels_of(effect: str, size: str) -> dict[str, float]:
    """Values of an effect's parameters, by their name in a model: at no effect, or at their scale."""
    values = {}
    for p in EFFECTS[effect].declared_parameters():
        none = p.none if p.none is not None else p.start
        values[f"{effect}.{p.name}"] = none if size == "none" else float(p.scale)
    return values


def network(model: Model, states: States, loads: torch.Tensor) -> Model:
    """Random weights, the scaling of these rows."""
    model.prepare(states, loads)
    effects = model.scalars()
    model.set_vector(starts(model, states, loads, 1, torch.Generator().manual_seed(3))[0])
    model.set_values(effects)
    return model


class EffectContract:
    effect: str
    family: str

    def states(self) -> States:
        return States.from_table(visits())

    def build(self, effects: list[str], values: dict[str, float], states: States | None = None, units=None) -> Model:
        """The model with effects; units: sizes of the units of load, for the network's scaling."""
        model = build_model(self.family, TRUTH[self.family] | values, effects)
        if self.family == "mlp":
            states = states or self.states()
            spread = torch.linspace(-1, 1, 2 * len(states), dtype=torch.float64).sin().reshape(-1, 2)
            size = torch.tensor([30.0, 0.2], dtype=torch.float64) * (1.0 if units is None else units)
            model = network(model, states, spread * size)
        return model

    def model(self, size: str = "scale") -> Model:
        return self.build([self.effect], labels_of(self.effect, size))

    # --- tests ----------------------------------------------------------------------------------------------

    def test_without_effect_the_loads_are_the_bare_models_to_the_last_bit(self):
        bare, states = self.build([], {}), self.states()
        assert torch.equal(self.model("none")(states).loads, bare(states).loads)

    def test_at_its_scale_it_shows_above_the_noise_and_stays_finite(self):
        states, noise = self.states(), torch.tensor([0.03, 6e-4], dtype=torch.float64)
        before, after = self.build([], {})(states), self.model()(states)
        assert after.loads.isfinite().all()
        assert ((after.loads - before.loads).abs().amax(0) > 2 * noise).any()

    def test_derivatives_by_parameters_are_those_of_differences(self):
        model, states = self.model(), self.states()
        problem = Problem(model, Rows(states, torch.ones(len(states), 2).double(), np.arange(len(states))))
        vector = model.vector().detach()
        reverse = problem.jacobians(vector[None])[0]
        forward = torch.func.jacfwd(problem.residual)(vector)
        torch.testing.assert_close(forward, reverse, rtol=1e-8, atol=1e-9 * float(reverse.abs().max()))
        labels = model.labels()
        for p in EFFECTS[self.effect].declared_parameters():
            column = labels.index(f"{self.effect}.{p.name}")
            step = torch.zeros_like(vector)
            step[column] = 1e-4 if p.log else 1e-4 * p.scale
            with torch.no_grad():
                slope = (problem.residual(vector + step) - problem.residual(vector - step)) / (2 * step[column])
            scale = float(slope.abs().max())
            torch.testing.assert_close(reverse[:, column], slope, rtol=1e-4, atol=1e-6 * scale)

    def test_derivatives_by_the_state_are_those_of_differences(self):
        model, states = self.model(), self.states()
        slopes = sensitivities(model, states)
        for i, (name, h) in enumerate((("length", 1e-6), ("twist", 1e-5), ("pressure", 1.0))):
            here = getattr(states, name)
            with torch.no_grad():
                up, down = (model(states.replace(**{name: here + s * h})).loads for s in (1, -1))
            expected = (up - down) / (2 * h)
            atol = 1e-6 * float(expected.abs().max())
            torch.testing.assert_close(slopes[:, :, i], expected, rtol=1e-5, atol=atol)

    def test_a_batch_is_its_rows(self):
        model, states = self.model(), self.states()
        with torch.no_grad():
            rows = torch.cat([model(states[slice(i, i + 1)]).loads for i in range(0, len(states), 8)])
            torch.testing.assert_close(model(states).loads[::8], rows, rtol=1e-9, atol=1e-9)

    def test_several_members_at_once_are_one_after_the_other(self):
        model, states = self.model(), self.states()
        vectors = model.vector().detach() * torch.tensor([[1.0], [1.01]], dtype=torch.float64)

        def loads(vector: torch.Tensor) -> torch.Tensor:
            return model(states, model.physical(vector)).loads

        with torch.no_grad():
            together, alone = torch.func.vmap(loads)(vectors), torch.stack([loads(v) for v in vectors])
        torch.testing.assert_close(together, alone, rtol=1e-9, atol=1e-9)

    def test_the_physics_does_not_depend_on_the_units(self):
        """Lengths in units of 1/a, forces of 1/b, times of 1/c: loads come out b and a b times as large."""
        a, b, c = 1.7, 0.6, 2.3
        states = self.states()

        def factor(unit: str) -> float:
            length, force, time = UNITS[unit]
            return a**length * b**force * c**time

        lengths = ("reference_length", "inner_radius", "outer_radius", "length")
        changed = {name: a * getattr(states, name) for name in lengths}
        changed |= {"pressure": b / a**2 * states.pressure}
        changed |= {"clock": c * states.clock, "dwell": c * states.dwell}
        other = states.replace(**changed)
        model = self.model()
        values = {n: v * factor(model.declared[n].unit) for n, v in model.scalars().items()}
        units = torch.tensor([b, a * b], dtype=torch.float64)
        rescaled = self.build([self.effect], values, other, units)
        torch.testing.assert_close(rescaled(other).loads, model(states).loads * units, rtol=1e-8, atol=1e-9)

    def test_joins_every_other_effect_whatever_their_order(self):
        states = self.states()[slice(2, None, 5)]
        for other, kind in EFFECTS.items():
            # Each pair once.
            if other <= self.effect or self.family not in kind.families():
                continue
            values = labels_of(self.effect, "scale") | labels_of(other, "scale")
            model = self.build([self.effect, other], values)
            turned = build_model(self.family, effects=[other, self.effect])
            assert [e.name for e in turned.effects] == [e.name for e in model.effects]
            with torch.no_grad():
                assert model(states).loads.isfinite().all(), other

    def test_conservative_effects_keep_reciprocity(self):
        """∂F/∂φ = ∂M/∂l at fixed pressure: wall, fluid and springs give back the work that is put in."""
        if EFFECTS[self.effect].port not in CONSERVATIVE or self.family == "mlp":
            return
        model, states = self.model(), self.states()
        with torch.no_grad():
            assert (model(states).status != Status.NO_EQUILIBRIUM).all()
        slopes = sensitivities(model, states)
        across = slopes[:, 0, 1]
        torch.testing.assert_close(across, slopes[:, 1, 0], rtol=1e-7, atol=1e-7 * float(across.abs().max()))
