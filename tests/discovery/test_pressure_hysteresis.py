"""A regulator that stays short of its setpoint is no friction."""

import numpy as np
import pytest

from freelearn.data.accuracy import PAPER
from freelearn.data.rows import Rows
from freelearn.discovery.search.search import search
from freelearn.discovery.search.testable import candidates, question_of_rows
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.laboratory import Laboratory, measure
from freelearn.testing.small_tables import recordings

ACTUATORS = {3: (36.0, 98.42, 4.77, 6.74), 6: (62.0, 99.0, 4.77, 6.36)}
NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
LAG = "pressure_hysteresis"


def build(names):
    return build_model("continuum", {}, names, list(ACTUATORS))


def searched(effects, seed):
    """What a search finds where the reference lags by a constant, in its own direction of the pressure."""
    bed = Laboratory(states=16, pressures=5, falling=3)
    table = measure(bed, ACTUATORS, 8e5, 2e7, effects, NOISE, seed).table
    table = table[table["buckled"] == 0].reset_index(drop=True)
    rows = Rows.from_table(table)
    return search(question_of_rows(build, table.columns, rows, PAPER, 0))


@pytest.mark.parametrize(("lag", "seed"), [(900.0, 1), (-700.0, 2)])
def test_a_regulator_or_a_gauge_that_lags_is_named_and_how_much(lag, seed):
    found = searched({LAG: {"pressure": lag}}, seed)
    assert (found.verdict, found.effects) == ("named", [LAG])
    assert found.final.fit.values()[f"{LAG}.pressure"] == pytest.approx(lag, rel=0.1)


def test_friction_is_not_taken_for_it():
    found = searched({"friction_hysteresis": {"force": 0.4, "moment": 0.015}}, 3)
    assert (found.verdict, found.effects) == ("named", ["friction_hysteresis"])


def test_the_loads_differ_by_what_the_lag_makes_of_them():
    """Rising by a lag is the same as standing there under less pressure, and the first row of a state has no way."""
    bed = Laboratory(states=6, pressures=4, falling=2)
    table = measure(bed, ACTUATORS, 8e5, 2e7, {}, dict.fromkeys(NOISE, 0.0), 0).table
    states = Rows.from_table(table).states
    lagging = build_model("continuum", {"C1": 8e5, "C2": 2e7, f"{LAG}.pressure": 1500.0}, [LAG])
    plain = build_model("continuum", {"C1": 8e5, "C2": 2e7})
    there = states.replace(pressure=states.pressure - 1500.0 * states.direction)
    np.testing.assert_allclose(lagging(states).loads.detach(), plain(there).loads.detach(), rtol=1e-12)
    assert set(np.sign(states.direction.numpy())) == {-1.0, 0.0, 1.0}


def test_along_a_log_it_is_asked_in_time():
    table = recordings()
    rows = Rows.from_table(table)
    _, out, unshown = candidates(build_model("continuum"), [], table.columns, rows)
    (reason,) = (c["reason"] for c in out if c["effect"] == LAG)
    assert "along a log" in reason
    assert LAG not in unshown
