"""What must hold of any answers: in whatever company and order they are asked for, scaled, mirrored, at rest."""

import numpy as np
import pandas as pd
import pytest
from fitted_folders import LOADS, PLACE, continuum, fitted, grid, shown
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nightly import usually

FREE = {"force_n": 0.0, "moment_nmm": 0.0}
BLANKS = [
    ["force_n", "moment_nmm"],
    PLACE,
    ["pressure_kpa"],
    ["twist_deg", "pressure_kpa"],
    ["elongation_mm", "force_n"],
]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    model = continuum()
    table = shown(model, pd.concat([grid(3), grid(6)], ignore_index=True))
    generator = np.random.default_rng(0)
    noise = generator.normal(size=(len(table), 2)) * (0.03, 0.6)
    return fitted(
        tmp_path_factory.mktemp("run"),
        model,
        table.assign(**dict(zip(LOADS, (table[LOADS] + noise).to_numpy().T, strict=True))),
    )


def questions(run, count, seed):
    """Rows of the run, each with another set of blanks."""
    table = run.table()[["sample", *PLACE, "pressure_kpa", *LOADS]].sample(count, random_state=seed, ignore_index=True)
    for i in range(count):
        table.loc[i, BLANKS[(i + seed) % len(BLANKS)]] = np.nan
    return table


def same(one, other):
    numbers = one.select_dtypes("number").columns
    np.testing.assert_allclose(one[numbers].to_numpy(float), other[numbers].to_numpy(float), rtol=1e-6, atol=1e-7)
    assert one["status"].tolist() == other["status"].tolist()
    assert one["note"].tolist() == other["note"].tolist()


@settings(max_examples=3, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 1000), count=st.integers(2, 10))
def test_neither_company_nor_order_matters(run, seed, count):
    table = questions(run, count, seed)
    whole = run.invert(table).filled
    order = np.random.default_rng(seed).permutation(count)
    shuffled = run.invert(table.iloc[order]).filled
    same(whole.iloc[order].reset_index(drop=True), shuffled)
    alone = run.invert(table.iloc[[0]]).filled
    same(whole.iloc[[0]][alone.columns], alone)


def test_many_rows_are_answered_as_each_alone(run):
    """So many that they are begun from a table of each actuator."""
    table = run.table()[["sample", "pressure_kpa", *LOADS]]
    many = run.invert(pd.concat([table] * 4, ignore_index=True), bands=False).filled
    few = pd.concat([run.invert(table.iloc[i : i + 40], bands=False).filled for i in range(0, len(table), 40)])
    same(many.iloc[: len(table)].reset_index(drop=True), few.reset_index(drop=True))
    same(many.iloc[-len(table) :].reset_index(drop=True), few.reset_index(drop=True))


@pytest.mark.parametrize("factor", usually(3.0, nightly=[0.5]))
def test_moduli_loads_and_pressure_scaled_alike_leave_the_pose(factor, tmp_path):
    one, other = continuum(), continuum(c1=factor * 8e5, c2=factor * 2e7)
    table = shown(one, grid(3))
    scaled = table.assign(**{n: factor * table[n] for n in ("pressure_kpa", *LOADS)})
    first = fitted(tmp_path / "one", one, table).invert(table.drop(columns=[*PLACE, "step"]), bands=False).filled
    second = fitted(tmp_path / "other", other, scaled).invert(scaled.drop(columns=[*PLACE, "step"]), bands=False).filled
    np.testing.assert_allclose(first[PLACE], second[PLACE], rtol=0, atol=1e-7)
    assert first["status"].tolist() == second["status"].tolist()


def test_the_mirrored_actuator_turns_the_other_way(run, tmp_path):
    table = run.table()[
        ["sample", "gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm", "pressure_kpa", *LOADS]
    ]
    mirrored = table.assign(gamma_deg=-table["gamma_deg"], moment_nmm=-table["moment_nmm"], sample=table["sample"] + 10)
    here, there = run.invert(table).filled, run.invert(mirrored).filled
    np.testing.assert_allclose(there["elongation_mm"], here["elongation_mm"], atol=1e-7)
    np.testing.assert_allclose(there["twist_deg"], -here["twist_deg"], atol=1e-6)
    assert (there["extrapolated"] == 1).all()
    assert there["note"].str.contains("not fitted on").all()


def test_a_free_end_without_pressure_is_at_rest(run):
    row = run.invert(pd.DataFrame({"sample": [3, 6], "pressure_kpa": 0.0, **FREE})).filled
    np.testing.assert_allclose(row[PLACE], 0.0, atol=1e-9)
    assert row["status"].tolist() == ["ok", "ok"]
    back = run.invert(pd.DataFrame({"sample": [3], "elongation_mm": 0.0, "twist_deg": 0.0, **FREE})).filled
    assert back["pressure_kpa"][0] == pytest.approx(0, abs=1e-3)


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(pressure=st.floats(0, 72), force=st.floats(-4, 4), moment=st.floats(-40, 40))
def test_the_loads_at_any_answer_are_those_given(run, pressure, force, moment):
    row = run.invert(
        pd.DataFrame({"sample": [6], "pressure_kpa": pressure, "force_n": force, "moment_nmm": moment})
    ).filled
    assert row["status"][0] == "ok"
    back = run.invert(row[["sample", *PLACE, "pressure_kpa"]]).filled
    np.testing.assert_allclose(back[LOADS], [[force, moment]], rtol=0, atol=1e-7)


def test_bands_change_nothing_but_themselves(run):
    table = questions(run, 20, 3)
    told, plain = run.invert(table).filled, run.invert(table, bands=False).filled
    ends = [name for name in told if name.endswith(("_low", "_high"))]
    assert told[ends].notna().any(axis=None)
    assert plain[ends].isna().all(axis=None)
    pd.testing.assert_frame_equal(told.drop(columns=ends), plain.drop(columns=ends))
