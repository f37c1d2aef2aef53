"""A sine of the pressure at one place, nothing hidden: what gauges and encoders flicker by is nothing systematic."""

import numpy as np
import pandas as pd
import pytest
import torch

from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.data.states import States
from freelearn.discovery.fits.prepare import Question, prepare
from freelearn.discovery.noise.shapes import history
from freelearn.discovery.noise.structure import structure
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.total_energy import bed_loads, state_of

TUBE = {"sample": 1, "gamma_deg": 36.0, "length_mm": 98.42, "inner_radius_mm": 4.77, "outer_radius_mm": 6.74}


def log(seed, flicker=0.0, rows=1000):
    """Ten rows a second, half a minute a period; encoders that read the place of every row (flicker, mm and 6°)."""
    noise, time = np.random.default_rng(seed), np.arange(rows) / 10.0
    pressure = 35 - 35 * np.cos(2 * np.pi * time / 25)
    table = pd.DataFrame({"time_s": time, "pressure_kpa": pressure}).assign(**TUBE, elongation_mm=1.0, twist_deg=20.0)
    loads, _ = bed_loads(state_of(table.assign(step=0)), 8e5, 2e7, {})
    for name, size in (("pressure_kpa", 0.15), ("elongation_mm", flicker), ("twist_deg", 6 * flicker)):
        table[name] += noise.normal(0, size, rows)
    table["force_n"] = loads[:, 0] + noise.normal(0, 0.03, rows)
    table["moment_nmm"] = 1e3 * loads[:, 1] + noise.normal(0, 0.6, rows)
    return table.assign(run=1, step=np.arange(rows), buckled=0)


def chance(table):
    """That noise alone looks as systematic as what the model without an effect leaves."""
    question = Question(lambda names: build_model("continuum", {}, names), [], Rows.from_table(table), PAPER, 0)
    prepared, fit, noise = prepare(question)
    return structure(fit.residual, fit.jacobian, prepared.rows.states, noise.whitener()).p_value


def test_a_gauge_s_noise_is_no_history():
    """Its readings stand in the shapes of a history and in the residuals: of eight logs none may look systematic at a
    chance of one in fifty, where the shapes hold the reading of their own row six in thirteen did at one in 500."""
    assert min(chance(log(seed)) for seed in range(100, 108)) > 0.02


def test_shapes_of_a_history_do_not_depend_on_the_reading_of_their_row():
    table = log(3, rows=60)
    before = history(States.from_table(table))
    for row in (20, 31):
        changed = table.copy()
        changed.loc[row, "pressure_kpa"] += 0.2
        after = history(States.from_table(changed))
        torch.testing.assert_close(after[row], before[row], rtol=0, atol=1e-12)
        assert not torch.equal(after[row + 1], before[row + 1])


def test_an_encoder_s_flicker_is_no_place():
    assert chance(log(101, flicker=0.005)) > 0.02
    read = log(101, flicker=0.005)
    states = States.from_table(read)
    assert len(torch.unique(states.length)) == 1
    assert float(states.length[0] - states.reference_length[0]) == pytest.approx(read["elongation_mm"].mean() * 1e-3)


def test_a_place_that_creeps_is_told_from_flicker():
    """By how readings follow each other: a bed that gives way with the pressure is where its encoder says."""
    creeping = log(102).assign(elongation_mm=lambda t: 1.0 + 3e-4 * t["pressure_kpa"])
    np.testing.assert_allclose(
        1e3 * (States.from_table(creeping).length - 98.42e-3), creeping["elongation_mm"], rtol=0, atol=1e-9
    )
