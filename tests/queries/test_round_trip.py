"""State → loads → state: every blank that was filled from a row of its own comes back as it was."""

import beds
import numpy as np
import pandas as pd
import pytest
import torch
from fitted_folders import LOADS, PLACE, continuum, design, fitted, folder_of, grid, shown
from nightly import usually

import freelearn
from freelearn.data.columns import with_members
from freelearn.data.states import States
from freelearn.physics.models.build import build_model
from freelearn.physics.simulated_bed import protocol
from freelearn.queries.inverse.system import System

MATERIALS = [(8e5, 2e7), (5e5, 1e6), (2e5, 1e6), (3e6, 3e6)]
RANGE = {"elongation_mm": 10.0, "twist_deg": 240.0, "pressure_kpa": 72.5}
EFFECTS = {
    "length_compliance": {"compliance": 2e-5},
    "twist_compliance": {"compliance": 0.5},
    "end_clamps": {"clamp_length": 5e-3},
    "twist_offset": {"angle": 0.05},
    "friction_hysteresis": {"force": 0.6, "moment": 2e-3},
    "sensor_crosstalk": {},
    "fiber_misalignment": {"angle": 0.02},
    "wall_stiffening": {},
    "pressure_offset": {"pressure": 600.0},
}


def error(found, truth, names=PLACE):
    """Largest distance of each row's answer from the truth, in ranges of the protocol."""
    return np.max([np.abs(found[n].to_numpy(float) - truth[n].to_numpy(float)) / RANGE[n] for n in names], axis=0)


def off(answers, truth):
    """The same, of the nearest of all answers of a row."""
    error_of = error(answers.filled, truth)
    for row, every in answers.every.groupby("row"):
        error_of[row] = error(every, truth.iloc[[row] * len(every)]).min()
    return error_of


def comes_back(fitted, table):
    """Asks for the places of a table's rows by their loads: those that are told, and are among what is told."""
    table = table.dropna(subset=LOADS).reset_index(drop=True)
    answers = fitted.invert(table.drop(columns=PLACE), bands=False)
    np.testing.assert_array_less(off(answers, table), 1e-8)
    single = (answers.filled["solutions"] == 1).to_numpy()
    assert set(answers.filled["status"]) <= {"ok", "unstable"}
    return answers, table, single


@pytest.mark.parametrize(("c1", "c2"), MATERIALS)
@pytest.mark.parametrize("sample", [1, 3, 6, 8])
def test_places_come_back_from_their_loads(c1, c2, sample, tmp_path):
    model = continuum(c1=c1, c2=c2)
    table = shown(model, protocol().query("sample == @sample").iloc[::23].reset_index(drop=True))
    run = fitted(tmp_path, model, table)
    answers, table, single = comes_back(run, table.drop(columns="step"))
    assert single.mean() > 0.5
    np.testing.assert_array_less(error(answers.filled[single], table[single]), 1e-8)


# Looked for step by step; each part of it is asked of others.
LONG = ["length_compliance", "twist_compliance"]


@pytest.mark.parametrize("effect", usually(*(name for name in EFFECTS if name not in LONG), nightly=LONG))
def test_places_come_back_whatever_effect_the_model_has(effect, tmp_path):
    model = continuum({effect: EFFECTS[effect]})
    if not EFFECTS[effect]:
        # Any strength but none.
        model.set_values({name: p.start + p.scale for name, p in model.declared.items() if "." in name})
    table = shown(model, grid(3))
    assert (table[LOADS] - shown(continuum(), grid(3))[LOADS]).abs().max().max() > 1e-3
    # Whole kinematic states, so that the steps still tell the pressure's direction.
    answers, *_ = comes_back(fitted(tmp_path, model, table), table.iloc[:40])
    assert len(answers) == 40


def test_in_the_play_of_a_mount_any_twist_is_an_answer_and_its_loads_are_the_ones_given(tmp_path):
    model = continuum({"twist_slack": {"angle": 0.1}})
    table = shown(model, grid(3))
    run = fitted(tmp_path, model, table)
    answers = run.invert(table.drop(columns=PLACE), bands=False).filled
    back = shown(model, table.assign(**{name: answers[name] for name in PLACE}))
    np.testing.assert_allclose(back[LOADS], table[LOADS], rtol=0, atol=1e-5)


def test_friction_acts_only_where_the_steps_tell_the_direction(tmp_path):
    """Friction acts against the pressure's last change, which the steps tell; a question without steps stands for
    itself, whatever question stands above it."""
    model = continuum({"friction_hysteresis": {"force": 0.6, "moment": 2e-3}})
    run = fitted(tmp_path, model, shown(model, grid(3)))
    question = pd.DataFrame({"elongation_mm": 1.0, "twist_deg": 10.0, "pressure_kpa": [20.0, 40.0, 20.0]})
    alone = run.invert(question, bands=False).filled
    assert alone["force_n"][0] == alone["force_n"][2]
    still = shown(continuum(), question.assign(**design(3)))
    np.testing.assert_allclose(alone["force_n"], still["force_n"], rtol=1e-9)
    up_and_down = run.invert(question.assign(step=[0, 1, 2]), bands=False).filled
    lag = up_and_down["force_n"] - still["force_n"]
    np.testing.assert_allclose(lag, [0.0, -0.6, 0.6], atol=1e-9)
    # Where the pressure before is blank, nobody knows in which direction it went.
    unknown = run.invert(question.assign(step=[0, 1, 2], pressure_kpa=[20.0, np.nan, 20.0]), bands=False).filled
    assert unknown["force_n"][2] == pytest.approx(still["force_n"][2])


def test_the_477_rows_without_an_equilibrium_are_said_to_have_none(tmp_path):
    model = continuum(c1=2e5, c2=1e6)
    table = protocol().query("sample == 1").reset_index(drop=True)
    with torch.no_grad():
        loads, _ = model(States.from_table(table))
    run = fitted(tmp_path, model, table.assign(force_n=loads[:, 0].numpy(), moment_nmm=1e3 * loads[:, 1].numpy()))
    answers = run.invert(table.drop(columns=LOADS), bands=False)
    lost = (answers.filled["status"] == "no_equilibrium").to_numpy()
    assert lost.sum() == 477
    assert answers.filled.loc[lost, LOADS].isna().all(axis=None)
    assert (answers.filled.loc[lost, "solutions"] == 0).all()
    assert answers.filled.loc[~lost, LOADS].notna().all(axis=None)


def test_a_ballooned_tube_is_no_answer(tmp_path):
    """Numbers that the formula gives beyond the last equilibrium are neither told nor counted."""
    model = continuum(c1=1e5, c2=2e6)
    table = shown(model, protocol().query("sample == 1").iloc[::13].reset_index(drop=True)).dropna()
    run = fitted(tmp_path, model, table.reset_index(drop=True))
    answers, *_ = comes_back(run, table)
    if len(answers.every):
        assert "no_equilibrium" not in set(answers.every["status"])
    # So high a pressure no place carries.
    row = run.invert(pd.DataFrame({"pressure_kpa": [2000.0], "force_n": 0.0, "moment_nmm": 0.0})).filled.iloc[0]
    assert (row["status"], row["solutions"]) == ("no_equilibrium", 0)
    assert np.isnan(row["elongation_mm"])


def test_places_of_braids_come_back_and_one_sample_may_hold_several_braids(tmp_path):
    places = [(dl, turn, p) for dl in (-2.0, 0.0, 2.0) for turn in (-40.0, 0.0, 40.0) for p in (0.0, 20.0, 40.0, 60.0)]
    table = pd.DataFrame(places, columns=[*PLACE, "pressure_kpa"])
    table = table.assign(gamma_deg=35.0, length_mm=110.0, inner_radius_mm=5.0, outer_radius_mm=6.2, step=0, buckled=0)
    table = pd.concat(
        [table.assign(sample=1, gamma2_deg=-35.0), table.assign(sample=2, gamma2_deg=-50.0),
         table.assign(sample=3, gamma2_deg=np.nan)], ignore_index=True,
    )  # fmt: skip
    model = continuum()
    table = shown(model, table)
    run = fitted(tmp_path, model, table)
    answers, *_ = comes_back(run, table)
    assert (answers.filled["extrapolated"] == 0).all()
    # By the sample's number alone, and by the design alone.
    design = ["gamma_deg", "gamma2_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"]
    comes_back(run, table.drop(columns=design))
    comes_back(run, table.drop(columns="sample"))
    # So many rows that they are begun from a table of each actuator: braids of one number are not one actuator.
    many = pd.concat([table.drop(columns="sample")] * 6, ignore_index=True)
    comes_back(run, many)


def test_places_of_an_end_block_come_back(tmp_path):
    table = with_members(beds.block({}), beds.MEMBERS)
    model = build_model("continuum", {"C1": beds.C1, "C2": beds.C2}, [], [1], 3)
    table = shown(model, table)
    run = fitted(tmp_path, model, table)
    answers, *_ = comes_back(run, table.iloc[::7])
    assert (answers.filled["status"] == "ok").all()


def test_a_run_in_a_folder_says_what_the_model_says(tmp_path):
    """The helpers of these tests write what freelearn.load reads."""
    model, table = continuum(), shown(continuum(), grid(6))
    run = freelearn.load(folder_of(tmp_path, model, table))
    np.testing.assert_allclose(run.predict(table).loads[:, 0], table["force_n"], rtol=1e-9)
    assert len(System.from_model(model, States.from_table(table))) == len(table)
