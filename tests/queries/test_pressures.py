"""The pressure to command: alone, with part of the pose, and of several actuators; and what cannot be reached."""

import beds
import numpy as np
import pandas as pd
import pytest
import torch
from fitted_folders import LOADS, PLACE, continuum, fitted, grid, shown
from scipy.optimize import least_squares, minimize

from freelearn.data.beds import NMM
from freelearn.data.columns import with_members
from freelearn.data.states import States
from freelearn.physics.models.build import build_model

PRESSURES = ["pressure_1_kpa", "pressure_2_kpa", "pressure_3_kpa"]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    model = continuum()
    return fitted(tmp_path_factory.mktemp("run"), model, shown(model, grid(3)))


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """Three actuators on one end block, without noise."""
    model = build_model("continuum", {"C1": beds.C1, "C2": beds.C2}, [], [1], 3)
    table = shown(model, with_members(beds.block({}), beds.MEMBERS))
    return fitted(tmp_path_factory.mktemp("block"), model, table)


@pytest.fixture
def rows(run):
    return run.table().query("pressure_kpa > 0 and step < 8").drop(columns="step").reset_index(drop=True)


@pytest.mark.parametrize("blank", [
    ["pressure_kpa"],
    ["pressure_kpa", "force_n"],
    ["pressure_kpa", "moment_nmm"],
    ["elongation_mm", "pressure_kpa"],
    ["twist_deg", "pressure_kpa"],
    ["elongation_mm", "twist_deg"],
    ["elongation_mm", "force_n"],
    ["elongation_mm", "moment_nmm"],
    ["twist_deg", "force_n"],
    ["twist_deg", "moment_nmm"],
    ["elongation_mm"],
    ["twist_deg"],
    ["force_n", "moment_nmm"],
    ["force_n"],
    ["moment_nmm"],
])  # fmt: skip
def test_whatever_two_are_blank_come_back(run, rows, blank):
    answers = run.invert(rows.assign(**dict.fromkeys(blank, np.nan)), bands=False)
    filled = answers.filled
    assert (filled["status"].isin(["ok", "unstable"])).all()
    assert (filled["solutions"] >= 1).all()
    # Where several answers there are, one of them is the row's own.
    error = (filled[blank] - rows[blank]).abs().max(axis=1)
    for row, every in answers.every.groupby("row"):
        error[row] = (every[blank] - rows.loc[row, blank]).abs().max(axis=1).min()
    # The least pressures are chosen with a small weight, which leaves a share of 1e-8 where the rest is a compromise.
    assert error.max() < 2e-5
    # And every answer is one: its loads are those given.
    back = shown(run.model, rows.assign(**{name: filled[name] for name in blank}))
    np.testing.assert_allclose(back[LOADS], filled[LOADS], rtol=0, atol=2e-4)


def test_of_several_pressures_the_least_is_told(run, rows):
    answers = run.invert(rows.assign(pressure_kpa=np.nan, elongation_mm=np.nan), bands=False)
    least = answers.every.query("stable == 1").groupby("row")["pressure_kpa"].apply(lambda p: p.abs().min())
    told = answers.filled.loc[least.index, "pressure_kpa"].abs()
    np.testing.assert_allclose(told, least, rtol=1e-9)


def test_a_row_that_contradicts_itself_is_unreachable_and_one_that_agrees_within_the_accuracy_is_ok(run, rows):
    some = rows.iloc[::9].reset_index(drop=True).assign(pressure_kpa=np.nan)
    for bands in (True, False):
        good = run.invert(some, bands=bands).filled
        assert (good["status"] == "ok").all()
        # Within two standard deviations of the bed's sensors.
        near = run.invert(some.assign(force_n=some["force_n"] + 0.06, moment_nmm=some["moment_nmm"] - 1.2), bands=bands)
        assert (near.filled["status"] == "ok").all()
        bad = run.invert(some.assign(moment_nmm=some["moment_nmm"] + 60), bands=bands).filled
        assert (bad["status"] == "unreachable").all()
        assert (bad["solutions"] == 0).all()
        assert bad["pressure_kpa"].notna().all()


def loads_at(block, place, pressures):
    """Force [N] and moment [N·mm] of the block at one place, at pressures [kPa]."""
    row = (
        block.table()
        .iloc[[0]]
        .assign(**dict(zip(PLACE, place, strict=True)), **dict(zip(PRESSURES, pressures, strict=True)))
    )
    row = row.assign(pressure_kpa=float(np.mean(pressures)))
    with torch.no_grad():
        return block.model(States.from_table(row)).loads[0].numpy() / (1, NMM)


@pytest.mark.parametrize(("place", "pressures"), [
    ((1.0, 10.0), (30.0, 20.0, 10.0)),
    ((-2.0, -40.0), (0.0, 50.0, 0.0)),
    pytest.param((0.0, 0.0), (5.0, 40.0, 30.0), marks=pytest.mark.nightly),
    pytest.param((2.0, 30.0), (60.0, 0.0, 40.0), marks=pytest.mark.nightly),
])  # fmt: skip
def test_of_many_pressures_with_the_same_loads_the_least_are_told(block, place, pressures):
    wanted = loads_at(block, place, pressures)
    question = pd.DataFrame([dict(zip([*PLACE, *LOADS], [*place, *wanted], strict=True))])
    row = block.invert(question).filled.iloc[0]
    assert row["status"] == "ok"
    found = row[PRESSURES].to_numpy(float)
    np.testing.assert_allclose(loads_at(block, place, found), wanted, rtol=0, atol=1e-4 * np.abs(wanted).max())
    # SciPy's own search for the least, in the same box: no pump gives less than the slack below the atmosphere.
    highest = block.table()[PRESSURES].max().max()
    best = minimize(
        lambda p: (p / 50) @ (p / 50),
        np.array(pressures),
        constraints={"type": "eq", "fun": lambda p: (loads_at(block, place, p) - wanted) / (1, 20)},
        bounds=[(-0.05 * highest, 1.05 * highest)] * 3,
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 200},
    )
    assert best.success
    assert found @ found <= best.x @ best.x * (1 + 1e-4) + 1e-3
    np.testing.assert_allclose(found, best.x, atol=0.15)


@pytest.mark.slow
def test_what_no_pressures_reach_is_answered_by_the_nearest(block):
    """Against SciPy's bounded least squares, in what the outputs count in: their largest size in the table."""
    place, wanted = (0.0, 0.0), np.array([400.0, -900.0])
    question = pd.DataFrame([dict(zip([*PLACE, *LOADS], [*place, *wanted], strict=True))])
    row = block.invert(question).filled.iloc[0]
    assert row["status"] == "unreachable"
    assert np.isnan(row["pressure_1_kpa_low"])
    scale = block.asker.scale.numpy() / (1, NMM)
    highest = block.table()[PRESSURES].max().max()
    best = least_squares(
        lambda p: (loads_at(block, place, p) - wanted) / scale,
        np.full(3, 20.0),
        bounds=([-0.05 * highest] * 3, [1.05 * highest] * 3),
        xtol=1e-12, ftol=1e-14, gtol=1e-12,
    )  # fmt: skip
    found = ((loads_at(block, place, row[PRESSURES].to_numpy(float)) - wanted) / scale) ** 2
    assert found.sum() <= 2 * best.cost * (1 + 1e-6)


def test_the_nearest_place_to_loads_out_of_reach(run):
    """Of one actuator: so strong a moment is beyond the span looked through."""
    wanted = np.array([0.0, 5000.0])
    row = run.invert(pd.DataFrame({"pressure_kpa": [30.0], "force_n": 0.0, "moment_nmm": 5000.0})).filled.iloc[0]
    assert (row["status"], row["solutions"]) == ("unreachable", 0)
    assert np.isnan(
        row[["elongation_mm_low", "elongation_mm_high", "twist_deg_low", "twist_deg_high"]].astype(float)
    ).all()
    scale = run.asker.scale.numpy() / (1, NMM)
    low, high = (v.numpy()[:2] for v in run.asker.span.looked)
    length = run.table()["length_mm"][0]

    def miss(x):
        at = run.table().iloc[[0]].assign(elongation_mm=x[0], twist_deg=x[1], pressure_kpa=30.0)
        return (shown(run.model, at)[LOADS].to_numpy()[0] - wanted) / scale

    bounds = ([(low[0] - 1) * length, np.degrees(low[1])], [(high[0] - 1) * length, np.degrees(high[1])])
    starts = [(0.0, 0.0), (3.0, -100.0), (-5.0, -150.0), (5.0, 100.0)]
    best = min((least_squares(miss, start, bounds=bounds) for start in starts), key=lambda r: r.cost)
    assert (miss(row[PLACE].to_numpy(float)) ** 2).sum() <= 2 * best.cost * (1 + 1e-5)


def test_of_an_end_block_some_pressures_may_be_given(block):
    place, pressures = (1.0, 10.0), (30.0, 20.0, 10.0)
    wanted = loads_at(block, place, pressures)
    question = pd.DataFrame([dict(zip([*PLACE, *LOADS], [*place, *wanted], strict=True))])
    row = block.invert(question.assign(pressure_2_kpa=20.0)).filled.iloc[0]
    assert row["status"] == "ok"
    # Two equations, two pressures: no choice is left but the weight of the least.
    np.testing.assert_allclose(row[PRESSURES].to_numpy(float), pressures, atol=0.01)
