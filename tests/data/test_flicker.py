"""Places that an encoder reads in every row: what it flickers by is no move of the bed."""

import numpy as np
import pandas as pd
import pytest

import freelearn as fl
from freelearn.data.accuracy import PAPER
from freelearn.data.intake.assemble import count_steps
from freelearn.data.rows import Rows
from freelearn.data.states import kinematic_state
from freelearn.discovery.checks.rows_order import order
from freelearn.discovery.checks.table_check import PASS
from freelearn.discovery.search.search import search
from freelearn.discovery.search.testable import question_of_rows
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.laboratory import Laboratory, measure
from freelearn.testing.small_tables import visits

ACTUATORS = {3: (36.0, 98.42, 4.77, 6.74)}
NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
HIDDEN = {"friction_hysteresis": {"force": 0.4, "moment": 0.015}}


@pytest.fixture(scope="module")
def exact():
    table = measure(Laboratory(states=20, pressures=5, falling=3), ACTUATORS, 8e5, 2e7, HIDDEN, NOISE, 5).table
    return table[table["buckled"] == 0].reset_index(drop=True)


@pytest.fixture(scope="module")
def flickering(exact):
    """The same rows, their places as encoders read them."""
    noise = np.random.default_rng(1)
    read = {
        name: exact[name] + noise.normal(0, size, len(exact))
        for name, size in (("elongation_mm", 0.008), ("twist_deg", 0.05))
    }
    return exact.assign(**read)


def test_the_states_are_those_of_the_set_places(exact, flickering):
    np.testing.assert_array_equal(kinematic_state(flickering), kinematic_state(exact))
    assert order(flickering).status == PASS


def test_a_coarse_encoder_s_flicker_is_told_by_the_gap_to_moves(exact):
    """Half a degree and 0.03 mm, one standard deviation: many rows differ from the last by more than 1 %."""
    noise = np.random.default_rng(2)
    read = exact.assign(
        elongation_mm=exact["elongation_mm"].round(0) * 2 + noise.normal(0, 0.03, len(exact)),
        twist_deg=exact["twist_deg"].round(-1) + noise.normal(0, 0.5, len(exact)),
    )
    moved = np.abs(np.diff(read["twist_deg"])) > 0.01 * read["twist_deg"].abs().max()
    assert (moved & (np.diff(kinematic_state(exact)) == 0)).mean() > 0.05
    np.testing.assert_array_equal(kinematic_state(read), kinematic_state(exact))


def test_steps_are_counted_as_at_the_set_places(exact, flickering):
    state = ["sample", "elongation_mm", "twist_deg"]
    np.testing.assert_array_equal(count_steps(flickering, state), exact["step"])
    table = fl.read_table(flickering.drop(columns="step"))
    np.testing.assert_array_equal(table["step"], exact["step"])


def test_of_a_hung_load_too():
    table = visits(count=4).drop(columns=["elongation_mm", "twist_deg"]).assign(bed="dead_load")
    load = np.repeat(np.tile([2.0, 5.0], len(table) // 8), 4)
    table = table.assign(step=np.arange(len(table)) % 4, force_n=load, moment_nmm=0.0)
    read = table.assign(force_n=load + np.random.default_rng(0).normal(0, 0.01, len(table)))
    np.testing.assert_array_equal(kinematic_state(read), kinematic_state(table))


def test_a_sweep_in_small_steps_stays_one():
    """A hundred lengths forth: each is a place of its own, a fiftieth of the largest from the next."""
    table = pd.DataFrame({"elongation_mm": np.linspace(-5, 5, 101), "twist_deg": 0.0})
    assert count_steps(table, ["elongation_mm", "twist_deg"]).tolist() == [0] * 101


def test_friction_is_named(flickering):
    rows = Rows.from_table(flickering)
    question = question_of_rows(lambda names: build_model("continuum", {}, names), flickering.columns, rows, PAPER, 0)
    found = search(question)
    assert (found.verdict, found.effects) == ("named", ["friction_hysteresis"])
