"""Are readings of one set pressure apart by the gauge's own errors, or was the pressure?"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from hidden_tables import MATERIAL, NOISE, table

from freelearn.data.accuracy import Accuracy
from freelearn.data.columns import with_members
from freelearn.data.rows import Rows
from freelearn.discovery.fits.prepare import Question, prepare
from freelearn.discovery.search.set_pressures import at_levels, set_again
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.other_beds import DESIGN_COLUMNS, measure_block, nominal
from freelearn.testing.reference.total_energy import MM, bed_loads, state_of

GAUGE = 0.6  # kPa, four times what is stated
ACCURACY = Accuracy.engineering(**NOISE)


def measured(own, seed=5, effects=None, kpa=GAUGE):
    """A table whose readings lie beside their levels by so much, of which this share is the gauge's own error and the
    rest the regulator's, which is there."""
    generator = np.random.default_rng(seed)
    made = table(effects or {}, seed, samples=(3,), share=0.3)
    pressure = made["step"].map(dict(enumerate([*np.linspace(0, 72.5, 8), 36.25, 0.0]))).to_numpy()
    there = pressure + generator.normal(0, kpa * np.sqrt(1 - own), len(made))
    loads, balanced = bed_loads(state_of(made.assign(pressure_kpa=there)), *MATERIAL, effects or {})
    return made.assign(
        pressure_kpa=there + generator.normal(0, kpa * np.sqrt(own), len(made)),
        force_n=loads[:, 0] + generator.normal(0, NOISE["force_n"], len(made)),
        moment_nmm=loads[:, 1] / MM + generator.normal(0, NOISE["moment_nmm"], len(made)),
        buckled=(~balanced).astype(int),
    ), pressure


def asked(made):
    return Question(lambda names: build_model("continuum", {}, names), [], Rows.from_table(made), ACCURACY, 0)


def answered(made):
    prepared, fit, noise = prepare(asked(made))
    return at_levels(prepared, fit, noise)


@pytest.mark.parametrize("effects", [{}, {"pressure_gain": {"gain": 0.05}, "end_clamps": {"clamp_length": 4e-3}}])
def test_what_a_gauge_errs_by_itself_is_taken_off(effects):
    """Whether the model is right or not: nothing that is missing goes by which reading of a level is high."""
    made, pressure = measured(1.0, effects=effects)
    found = answered(made)
    assert found is not None
    # Each level is known as well as the mean of its readings.
    errors = found.rows.states.pressure.numpy() / 1e3 - pressure
    assert np.abs(errors).max() < 4 * GAUGE / np.sqrt(len(made) / 10)
    assert found.accuracy.pressure == 0.0
    assert found.accuracy.force == ACCURACY.force
    one = found.rows.levels.group == found.rows.levels.group[0]
    error = float(found.rows.levels.error[0, 0])
    assert error == pytest.approx(1e3 * GAUGE / np.sqrt(int(one.sum())), rel=0.1)


def test_a_regulator_that_scatters_is_left_as_the_gauge_read_it():
    assert answered(measured(0.0)[0]) is None


def test_of_half_each_a_half_is_taken_off():
    made, _ = measured(0.5)
    found = answered(made)
    assert found is not None
    before, after = Rows.from_table(made).states.pressure, found.rows.states.pressure
    known = set_again(Rows.from_table(made))
    beside = known.beside[:, 0]
    share = float(((before - after) * beside).sum() / beside.square().sum())
    assert share == pytest.approx(0.5, abs=0.1)
    assert found.accuracy.pressure == pytest.approx(ACCURACY.pressure * np.sqrt(1 - share), rel=1e-6)


def test_levels_are_told_by_the_gaps_between_them():
    made, pressure = measured(1.0)
    known = set_again(Rows.from_table(made))
    # The falling row at half the pressure is a level of its own, and so is the one at rest.
    levels = {tuple(x) for x in zip(pressure, (made["step"] >= 8).to_numpy(), strict=True)}
    first = (made["step"] == 0).to_numpy(copy=True)
    assert len(torch.unique(known.group)) in (len(levels), len(levels) + 1)
    assert len(torch.unique(known.group[torch.as_tensor(first)])) == 1
    assert float(known.variance) ** 0.5 / 1e3 == pytest.approx(GAUGE, rel=0.05)


def test_of_pressures_anywhere_of_exact_ones_and_of_a_few_there_are_no_levels():
    made, pressure = measured(1.0)
    rows = Rows.from_table(made)
    anywhere = torch.as_tensor(np.random.default_rng(1).uniform(0, 7e4, len(rows)))
    for other in (anywhere, torch.as_tensor(pressure * 1e3), torch.zeros(len(rows), dtype=torch.float64)):
        assert set_again(replace(rows, states=rows.states.replace(pressure=other))) is None
    assert set_again(rows[:10]) is None


def test_a_level_of_few_readings_is_taken_for_their_mean_too():
    """What their mean errs by is told of all of them: it has to be the mean's."""
    made, pressure = measured(1.0)
    rare = np.flatnonzero((pressure == 36.25).astype(bool))[3:]
    made = made.drop(index=rare).reset_index(drop=True)
    before, found = Rows.from_table(made), answered(made)
    three = torch.as_tensor(np.flatnonzero(np.delete(pressure, rare) == 36.25))
    assert len(three) == 3
    after = found.rows.states.pressure[three]
    torch.testing.assert_close(after, before.states.pressure[three].mean().expand(3), rtol=1e-12, atol=0)
    error = found.rows.levels.error[three, 0]
    assert float(error[0]) == pytest.approx(1e3 * GAUGE / np.sqrt(3), rel=0.1)
    assert torch.equal(error, error[:1].expand(3))


MEMBERS = {1: (40.0, np.nan, 100.0, 5.0, 7.0), 2: (-52.0, np.nan, 100.0, 5.0, 7.0), 3: (33.0, np.nan, 100.0, 4.5, 6.0)}


def block(own):
    """Three actuators on a block, each filled in steps while one of the others is empty and one is half full, read with
    errors of the gauges' own or where the pressures really were."""
    generator = np.random.default_rng(7)
    ladder = np.linspace(0, 60, 5)
    filled = np.array([np.roll([p, 0, 30], turn) for turn in range(3) for p in ladder])
    places = np.stack([np.linspace(-3, 4, 6), generator.uniform(-30, 30, 6)], axis=1)
    made = nominal("kinematic", {1: (np.nan,) * 5}, places, np.zeros(len(filled)))
    made = made.drop(columns=[*DESIGN_COLUMNS, "pressure_kpa"])
    names = [f"pressure_{n}_kpa" for n in MEMBERS]
    made[names] = np.tile(filled, (6, 1))
    beside = generator.normal(0, GAUGE, (len(made), 3))
    errors = {**NOISE, "pressure_kpa": 1e-6}
    there = made.assign(**dict(zip(names, (made[names] + (not own) * beside).to_numpy().T, strict=True)))
    seen = measure_block(there, MEMBERS, *MATERIAL, {n: {} for n in MEMBERS}, 3, errors)
    seen[names] = made[names].to_numpy() + beside
    designs = pd.DataFrame([{"member": n, **dict(zip(DESIGN_COLUMNS, d, strict=True))} for n, d in MEMBERS.items()])
    return with_members(seen, designs), np.tile(filled, (6, 1))


@pytest.mark.parametrize("own", [True, False])
def test_each_pressure_of_a_block_has_levels_of_its_own(own):
    made, filled = block(own)
    question = Question(
        lambda names: build_model("continuum", {}, names, None, 3), [], Rows.from_table(made), ACCURACY, 0
    )
    prepared, fit, noise = prepare(question)
    found = at_levels(prepared, fit, noise)
    if not own:
        assert found is None
        return
    assert found is not None
    there = torch.stack([member.pressure for member in found.rows.states.members], dim=1).numpy() / 1e3
    before = torch.stack([member.pressure for member in question.rows.states.members], dim=1).numpy() / 1e3
    assert np.square(there - filled).sum() < np.square(before - filled).sum() / 4
    torch.testing.assert_close(found.rows.states.pressure, torch.as_tensor(1e3 * there.mean(1)), rtol=1e-12, atol=0)
    # The mean of 30 readings at rest errs less than that of six.
    errors = found.rows.levels.error.numpy()
    assert errors.shape == (len(made), 3)
    assert (errors.max(0) > 1.5 * errors.min(0)).all()


def test_a_pressure_of_a_block_that_was_set_to_no_level_is_left():
    made, _ = block(True)
    made["pressure_2_kpa"] = np.random.default_rng(2).uniform(0, 60, len(made))
    known = set_again(Rows.from_table(made))
    assert bool((known.beside[:, 1] == 0).all())
    assert bool((known.beside[:, [0, 2]] != 0).any(0).all())
    assert known.variance[1] == 0
    for n in MEMBERS:
        made[f"pressure_{n}_kpa"] = made["pressure_2_kpa"]
    assert set_again(Rows.from_table(made)) is None
