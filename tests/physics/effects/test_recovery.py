"""Effects hidden in noisy measurements are found again by a fit, within their standard errors."""

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.data.beds import NMM
from freelearn.data.rows import Rows, loads_of
from freelearn.data.states import States, kinematic_state
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.fitting.problem import Problem
from freelearn.fitting.uncertainty import uncertainty
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import build_model
from freelearn.physics.simulated_bed import DESIGNS
from freelearn.testing.effects import TRUTH, labels_of

OPTIONS = FitOptions("levenberg_marquardt", max_epochs=200, restarts=1, patience=6)
# One standard deviation, as `data.accuracy` has it for the paper's bed; position errs once per kinematic state.
POSITION = {"elongation_mm": 0.073, "twist_deg": 0.175}
PRESSURES = (0.0, 30.0, 72.5, 30.0)


def truth_table(count: int, samples: tuple[int, ...], seed: int) -> pd.DataFrame:
    """What was really imposed: kinematic states in random order, each with pressures up and down, 45 s a row."""
    generator = np.random.default_rng(seed)
    columns = ["sample", "gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"]
    designs = pd.DataFrame([(s, *DESIGNS[s - 1]) for s in samples for _ in range(count)], columns=columns)
    designs["elongation_mm"] = generator.uniform(-5, 5, len(designs))
    designs["twist_deg"] = generator.uniform(-120, 120, len(designs))
    table = designs.loc[designs.index.repeat(len(PRESSURES))].reset_index(drop=True)
    step = np.arange(len(table)) % len(PRESSURES)
    return table.assign(step=step, pressure_kpa=np.array(PRESSURES)[step], time_s=45.0 * np.arange(len(table)))


def measured(truth: pd.DataFrame, effects: list[str], values: dict[str, float], seed: int = 0) -> Rows:
    """The rows that the bed reports of an actuator with these effects: shown state, loads with noise."""
    generator = np.random.default_rng(seed)
    samples = sorted(set(truth["sample"]))
    model = build_model("continuum", TRUTH["continuum"] | values, effects, samples)
    with torch.no_grad():
        loads, status = model(States.from_table(truth))
    assert (status == 0).all()
    shown = truth.copy()
    for name, deviation in POSITION.items():
        shown[name] += np.repeat(generator.normal(0, deviation, len(truth) // 4), 4)
    shown["pressure_kpa"] += generator.normal(0, 0.15, len(truth))
    shown["force_n"] = loads[:, 0].numpy() + generator.normal(0, 0.03, len(truth))
    shown["moment_nmm"] = loads[:, 1].numpy() / NMM + generator.normal(0, 0.6, len(truth))
    # The direction of the pressure is the bed's command, not its noise.
    states = States.from_table(shown).replace(direction=States.from_table(truth).direction)
    return Rows.whole(states, loads_of(shown), kinematic_state(shown))


def check(rows: Rows, effects: list[str], values: dict[str, float], samples: tuple[int, ...]):
    model = build_model("continuum", effects=effects, samples=samples)
    fit(model, rows, rows[torch.arange(0)], OPTIONS, seed=0)
    found = uncertainty(Problem(model, rows))
    truth = TRUTH["continuum"] | values
    for name, value, error in zip(found.names, found.values, found.stderr, strict=True):
        assert np.isfinite(error), name
        assert abs(value - truth[name]) < 4 * error, (name, value, truth[name], error)
    return dict(zip(found.names, found.stderr, strict=True))


# Effects of the history act along logs: tests/physics/test_history.py. A modulus of one actuator alone is C1 itself, or
# C2: tests/physics/test_own_moduli.py.
ALONE = [name for name, effect in EFFECTS.items() if effect.port != "history" and not effect.compares]


@pytest.mark.parametrize("name", ALONE)
def test_the_fit_finds_the_effect_that_made_the_data(name):
    values = labels_of(name, "scale")
    table = truth_table(50, (4,), seed=1)
    errors = check(measured(table, [name], values), [name], values, (4,))
    # The rows can tell the effect from none, so finding it within its error says something.
    assert any(4 * errors[label] < abs(value) for label, value in values.items())


def test_each_sample_gets_its_own_mounting_error():
    values = {"twist_offset.angle[3]": 0.1, "twist_offset.angle[4]": -0.15, "pressure_gain.gain": 0.04}
    effects, samples = ["pressure_gain", "twist_offset"], (3, 4)
    rows = measured(truth_table(25, samples, seed=2), effects, values)
    errors = check(rows, effects, values, samples)
    assert all(4 * errors[label] < abs(value) for label, value in values.items())
