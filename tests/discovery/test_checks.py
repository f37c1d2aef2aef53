"""The look at a table before a search: each check on a table that it has to stop, and on those that it must not."""

import time

import numpy as np
import pandas as pd
import pytest
from hidden_tables import NOISE, table
from nightly import usually

from freelearn.data.accuracy import Accuracy
from freelearn.discovery.checks.column_readings import _swaps
from freelearn.discovery.checks.look import failed, looked_over, useless
from freelearn.discovery.checks.rows_order import order
from freelearn.discovery.checks.table_check import CANNOT, FAIL, PASS, actuator
from freelearn.discovery.checks.zeros_of_places import _springs
from freelearn.physics.models.build import build_model
from freelearn.testing.reference.hung_logs import hung_log

ACCURACY = Accuracy.engineering(**NOISE)


def build(names):
    return build_model("continuum", {}, list(names))


def looked(rows, given=(), accuracy=ACCURACY):
    return looked_over(rows, build, list(given), accuracy)


def said(rows, **how):
    return " ".join(f"{check.name}: {check.sentence}" for check in failed(looked(rows, **how)))


@pytest.fixture(scope="module")
def plain():
    rows = table({}, samples=(3,))
    return rows[rows["buckled"] == 0].reset_index(drop=True)


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"friction_hysteresis": {"force": 0.6, "moment": 0.02}},
        {"force_offset": {"force": 1.5}},
        {"length_offset": {"length": 1e-3}},
    ],
)
def test_a_table_that_was_mapped_rightly_passes_whatever_hides_in_it(effects):
    rows = table(effects)
    assert failed(looked(rows[rows["buckled"] == 0].reset_index(drop=True))) == []


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (["force_n"], "force_n has its sign turned"),
        (["moment_nmm"], "moment_nmm"),
        pytest.param(["elongation_mm"], "elongation_mm has its sign turned", marks=pytest.mark.nightly),
        pytest.param(["gamma_deg"], "gamma_deg has its sign turned", marks=pytest.mark.nightly),
    ],
)
def test_a_turned_sign_is_said(plain, columns, words):
    assert words in said(plain.assign(**{name: -plain[name] for name in columns}))


@pytest.mark.parametrize(
    ("name", "factor", "words"),
    [
        ("pressure_kpa", 1 / 6.894757, "psi"),
        ("force_n", 1 / 9.80665, "kgf"),
        pytest.param("moment_nmm", 1e-3, "N·m", marks=pytest.mark.nightly),
        pytest.param("twist_deg", np.pi / 180, "rad", marks=pytest.mark.nightly),
    ],
)
def test_another_unit_is_said(plain, name, factor, words):
    assert words in said(plain.assign(**{name: factor * plain[name]}))


def test_a_gel_that_few_kilopascals_inflate_is_no_table_in_psi(plain):
    """A twelfth of the moduli, the pressures and the loads is the same tube: its numbers look like psi, its mechanics
    do not. The same stiff tube in psi is told by both."""
    loads = ["pressure_kpa", "force_n", "moment_nmm"]
    gel = plain.assign(**{name: plain[name] / 12 for name in loads})
    (check,) = [check for check in looked(gel) if check.name == "numbers of a column"]
    assert check.status == PASS
    assert "in psi" in check.says
    assert check.figure > 5
    assert failed(looked(gel)) == []
    assert "numbers of a column" in said(plain.assign(pressure_kpa=plain["pressure_kpa"] / 6.894757))


def test_what_goes_with_the_place_was_not_zeroed_there():
    """Rubber beside threads that hang loose without pressure: less than the noise in each row, seen in all of them."""
    noise = np.random.default_rng(0)
    found = {0.0: 0, 1.0: 0}
    for slope in found:
        for _ in range(100):
            first = pd.DataFrame({"sample": 1, "elongation_mm": 0.0, "twist_deg": noise.uniform(-2, 2, 40)})
            first["moment_nmm"] = noise.normal(size=40) - slope * first["twist_deg"]
            found[slope] += _springs(first, "moment_nmm")
    assert found[0.0] <= 2
    assert found[1.0] >= 95


@pytest.mark.parametrize("columns", usually(["force_n", "moment_nmm"], nightly=[["force_n"]]))
def test_a_cell_that_was_zeroed_at_each_place_is_said(columns):
    rows = table({"wall_thickness": {"outer_radius": 2e-4}}, samples=(3, 6))
    state = np.cumsum(rows["step"] == 0)
    zeroed = rows.assign(**{name: rows[name] - rows[name].groupby(state).transform("first") for name in columns})
    checks = [check for check in failed(looked(zeroed)) if check.name == "zero of each place"]
    assert f"{' and '.join(columns)} begin" in checks[0].says
    assert useless(failed(looked(zeroed))) == checks[0]


def test_one_zero_for_all_places_is_none_of_each(plain):
    """A tube of which nothing is known at rest, and one whose first row everywhere is nearly without load."""
    for rows in (plain.assign(force_n=plain["force_n"] + 3.0), plain[plain["step"] > 0].reset_index(drop=True)):
        assert "zeroed at each place" not in said(rows)


def test_exchanged_columns_are_said(plain):
    swapped = plain.assign(force_n=plain["moment_nmm"], moment_nmm=plain["force_n"])
    assert "force_n and moment_nmm are exchanged" in said(swapped)


def test_a_column_without_a_reading_is_not_exchanged_with_another():
    rows = pd.DataFrame(
        {"elongation_mm": np.nan, "twist_deg": [1.0, 2.0], "force_n": [0.0, 1.0], "moment_nmm": [2.0, 3.0]}
    )
    assert [reading.says for reading in _swaps(rows)] == ["force_n and moment_nmm are exchanged"]


def test_a_load_cell_that_was_not_tared_is_said_and_fitted_offsets_answer_it(plain):
    heavy = plain.assign(force_n=plain["force_n"] + 15.0)
    words = said(heavy)
    assert "not tared" in words
    assert "effects=[force_offset,moment_offset]" in words
    assert "not tared" not in said(heavy, given=["force_offset", "moment_offset"])


def test_a_cell_that_was_not_tared_is_seen_of_several_samples_which_have_a_zero_each():
    rows = table({}, samples=(3, 6))
    away = rows[(rows["pressure_kpa"] > 2) & (rows["elongation_mm"].abs() > 0.2)].reset_index(drop=True)

    def words(force):
        heavy = away.assign(force_n=away["force_n"] + force)
        found = looked_over(heavy, lambda names: build_model("continuum", {}, list(names), [3, 6]), [], ACCURACY)
        return " ".join(check.sentence for check in failed(found))

    assert "not tared" in words(40.0)
    assert "not tared" not in words(0.0)


def test_a_mount_that_is_off_by_as_little_as_mounts_are_is_said_beside_a_cell_that_was_not_tared(plain):
    """Without a row at rest a length that is off by 1.6 mm reads like a zero of the force, which of both a search is
    left to tell; none reads like 40 N."""
    for effects, force, status in (({"length_offset": {"length": 1.6e-3}}, 0.0, CANNOT), ({}, 40.0, FAIL)):
        rows = table(effects, samples=(3,))
        near = rows["elongation_mm"].abs().between(0.2, 2.0) & (rows["pressure_kpa"] < 40) & (rows["pressure_kpa"] > 2)
        rows = rows[near & (rows["buckled"] == 0)].reset_index(drop=True)
        (check,) = [c for c in looked(rows.assign(force_n=rows["force_n"] + force)) if c.name == "loads at rest"]
        assert "not tared" in check.says
        assert check.status == status
        assert ("the mount is off by" in check.says) == (status == CANNOT)


def test_what_an_absolute_pressure_does_to_the_loads_is_no_zero_of_theirs(plain):
    words = said(plain.assign(pressure_kpa=plain["pressure_kpa"] + 101.3))
    assert "absolute, not gauge" in words
    assert "not tared" not in words


def test_a_sorted_table_is_said(plain):
    ordered = plain.drop(columns="time_s", errors="ignore").sort_values("pressure_kpa", kind="stable")
    assert order(ordered.reset_index(drop=True)).status == FAIL
    assert order(plain).status == PASS
    assert order(plain.iloc[:5]).status == CANNOT


def test_a_diameter_that_rises_with_the_pressure_all_along_was_not_sorted():
    """Inflated once, at a length that scatters; sorted by the diameter, the pressures would run up and down."""
    rng = np.random.default_rng(3)
    pressure = np.linspace(0, 16, 20)
    table = pd.DataFrame({
        "sample": 1, "step": range(20), "twist_deg": 0.0, "elongation_mm": rng.normal(0.6, 0.02, 20),
        "pressure_kpa": pressure, "outer_diameter_mm": 0.6 + 0.03 * pressure, "force_n": rng.normal(0.02, 0.001, 20),
        "bed": "inflation",
    })  # fmt: skip
    assert order(table).status == PASS
    scattered = table.assign(pressure_kpa=rng.permutation(pressure))
    assert order(scattered).status == FAIL


@pytest.mark.parametrize(
    ("column", "value"),
    [("length_mm", 0.09), ("gamma_deg", 0.5), ("inner_radius_mm", 6.73), ("elongation_mm", 400.0)],
)
def test_a_size_that_no_actuator_has_is_said(plain, column, value):
    check = actuator(plain.assign(**{column: value}))
    assert check.status == FAIL
    assert "no actuator is like that" in check.says


def test_an_accuracy_that_repeats_refute_is_said(plain):
    generator = np.random.default_rng(0)
    again = plain.assign(force_n=plain["force_n"] + generator.normal(0, 4.0, len(plain)))
    twice = pd.concat([plain.assign(elongation_mm=plain["elongation_mm"] + 1e-3), again], ignore_index=True)
    assert "data.accuracy" in said(twice)


def test_what_a_log_s_samples_remember_is_no_misstated_accuracy():
    """A tube that hangs is under one load at one pressure again and again, on the way up and down: 7 times as much as
    stated, and no answer of its search was let stand."""
    made = hung_log({"supply_lag": {"time": 0.5}}, 0, recordings=3)
    accuracy = Accuracy.engineering(**made.accuracy)
    (check,) = [check for check in looked(made.table, accuracy=accuracy) if check.name == "stated accuracy"]
    assert check.status == CANNOT
    assert "A log's samples" in check.says
    # The same rows as a table have repeats that say so.
    as_table = made.table.drop(columns=["time_s", "run"])
    (check,) = [check for check in looked(as_table, accuracy=accuracy) if check.name == "stated accuracy"]
    assert check.status == FAIL


def test_a_look_takes_two_seconds_at_most_also_at_a_wrong_table(plain):
    many = pd.concat([plain] * (1 + 2000 // len(plain)), ignore_index=True).iloc[:2000]
    began = time.process_time()
    looked(many.assign(force_n=-many["force_n"]))
    assert time.process_time() - began < 4


def test_a_cell_at_the_end_of_its_range_is_said_and_no_search_runs(plain):
    most = 0.7 * plain["force_n"].abs().max()
    clipped = looked(plain.assign(force_n=plain["force_n"].clip(-most, most)))
    says = next(check for check in failed(clipped) if check.name == "ends of range")
    assert f"{most:.5g}" in says.sentence
    assert "left_out" in says.sentence
    assert useless(clipped) is says


def test_of_coarse_digits_the_model_says_whether_a_column_s_end_is_the_cell_s(plain):
    largest = plain["force_n"].abs().max()
    coarse = (plain["force_n"] / largest * 60).round() * largest / 60
    assert "ends of range" not in said(plain.assign(force_n=coarse))
    assert "ends of range" in said(plain.assign(force_n=coarse.clip(-largest / 2, largest / 2)))


def test_a_log_that_holds_the_largest_load_is_not_at_the_end_of_its_cell(plain):
    """The place of the largest force, of which a cell with coarse digits reads the same again and again."""
    highest = plain.loc[[plain["force_n"].abs().idxmax()] * 40]
    held = pd.concat([plain, highest]).reset_index(drop=True)
    assert "ends of range" not in said(held.assign(force_n=held["force_n"].round(1)))
