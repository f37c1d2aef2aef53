"""freelearn.load(…).invert(frame): what comes back of a table with blanks, and what is said of one without sense."""

import warnings
from types import SimpleNamespace

import beds
import numpy as np
import pandas as pd
import pytest
from fitted_folders import LOADS, PLACE, continuum, design, fitted, grid, shown

from freelearn.common.errors import UserError
from freelearn.data.columns import with_members
from freelearn.physics.effects.dissipation.friction_hysteresis import FrictionHysteresis
from freelearn.physics.models.build import build_model
from freelearn.report.tables.answer_tables import answer_lines, answers_table

STATUSES = {"ok", "no_equilibrium", "singular", "overstretched", "unstable", "unreachable", "unanswered"}
FREE = {"pressure_kpa": [20.0], "force_n": [0.0], "moment_nmm": [0.0]}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two samples, and a little noise."""
    model = continuum()
    table = shown(model, pd.concat([grid(3), grid(6)], ignore_index=True))
    noise = np.random.default_rng(0).normal(size=(len(table), 2)) * (0.03, 0.6)
    table[LOADS] += noise
    return fitted(tmp_path_factory.mktemp("run"), model, table)


@pytest.fixture(scope="module")
def lone(tmp_path_factory):
    """One sample."""
    model = continuum()
    return fitted(tmp_path_factory.mktemp("lone"), model, shown(model, grid(3)))


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    model = build_model("continuum", {"C1": beds.C1, "C2": beds.C2}, [], [1], 3)
    return fitted(tmp_path_factory.mktemp("block"), model, shown(model, with_members(beds.block({}), beds.MEMBERS)))


def test_each_filled_column_is_followed_by_its_band(run):
    answers = run.invert(pd.DataFrame({"sample": [3, 6], "remark": ["a", "b"], **{k: v * 2 for k, v in FREE.items()}}))
    assert list(answers.table()) == [
        "sample", "remark", "pressure_kpa", "force_n", "moment_nmm", "elongation_mm", "elongation_mm_low",
        "elongation_mm_high", "twist_deg", "twist_deg_low", "twist_deg_high", "solutions", "status", "extrapolated",
        "note",
    ]  # fmt: skip
    table = answers.table()
    assert table["remark"].tolist() == ["a", "b"]
    for name in PLACE:
        assert (table[f"{name}_low"] < table[name]).all()
        assert (table[name] < table[f"{name}_high"]).all()
    assert answers.asked == tuple(PLACE)


def test_what_was_given_stays_to_the_last_bit_and_has_no_band(run):
    place = {"elongation_mm": [1 / 3, np.nan], "twist_deg": [0.1, 0.2], "pressure_kpa": 7.7}
    question = pd.DataFrame({"sample": 3, **place, "force_n": [np.nan, 0.1], "moment_nmm": np.nan})
    table = run.invert(question).table()
    assert table["elongation_mm"][0] == 1 / 3
    assert np.isnan(table["elongation_mm_low"][0])
    assert np.isfinite(table["elongation_mm_low"][1])
    assert np.isnan(table["force_n_low"][1])


def test_a_table_without_blanks_comes_back_as_it_is(run):
    rows = run.table()[["sample", *PLACE, "pressure_kpa", *LOADS]].head(5)
    answers = run.invert(rows)
    pd.testing.assert_frame_equal(answers.table()[list(rows)], rows, check_dtype=False)
    assert answers.asked == ()
    assert (answers.table()["status"] == "ok").all()
    assert not any(name.endswith("_low") for name in answers.table())


def test_rows_with_too_many_blanks_are_unanswered_and_say_what_to_give(run):
    table = run.invert(pd.DataFrame({"sample": [3, 3, 3], "pressure_kpa": [20.0, np.nan, np.nan],
                                     "force_n": [1.0, 1.0, np.nan]})).table()  # fmt: skip
    assert table["status"].tolist() == ["unanswered"] * 3
    assert (table["solutions"] == 0).all()
    assert table["note"][0] == "one blank too many to find elongation and twist: give moment_nmm"
    assert "two of them" not in table["note"][1]
    assert table["note"][2].startswith("3 blanks too many")
    assert table[[name for name in PLACE if name in table]].isna().all(axis=None)
    assert (table["extrapolated"] == 0).all()


def test_the_sample_or_the_design_say_which_actuator_is_meant_row_by_row(run):
    own, other = design(3), design(5)
    question = pd.DataFrame([
        {"sample": 3, **{k: v[0] for k, v in FREE.items()}},
        {**own, **{k: v[0] for k, v in FREE.items()}},
        {**other, **{k: v[0] for k, v in FREE.items()}},
    ])  # fmt: skip
    table = run.invert(question).table()
    np.testing.assert_allclose(table["twist_deg"][0], table["twist_deg"][1], rtol=1e-9)
    assert table["extrapolated"].tolist() == [0, 0, 1]
    assert table["note"][2] == "an actuator that the model was not fitted on"
    # A design given in part is not thrown away: the rest is its sample's.
    part = run.invert(pd.DataFrame({"sample": [3], "gamma_deg": 50.0, **FREE})).table()
    whole = run.invert(pd.DataFrame({**own, "gamma_deg": 50.0, **FREE})).table()
    np.testing.assert_allclose(part["twist_deg"], whole["twist_deg"], rtol=1e-9)
    assert part["twist_deg"][0] != pytest.approx(table["twist_deg"][0], rel=1e-3)
    assert part["extrapolated"][0] == 1


def test_a_run_of_one_sample_needs_no_column_sample(lone):
    row = lone.invert(pd.DataFrame(FREE)).table().iloc[0]
    named = lone.invert(pd.DataFrame({"sample": [3], **FREE})).table().iloc[0]
    assert row["twist_deg"] == named["twist_deg"]
    assert row["extrapolated"] == 0


def test_beyond_what_was_measured_is_marked(lone):
    """The table went to ±4 mm, ±90° and 72.5 kPa."""
    rows = pd.DataFrame({"elongation_mm": [3.9, 4.5, 0.0, 0.0, 0.0], "twist_deg": [0.0, 0.0, 95.0, 0.0, 0.0],
                         "pressure_kpa": [30.0, 30.0, 30.0, 80.0, -5.0]})  # fmt: skip
    table = lone.invert(rows).table()
    assert table["extrapolated"].tolist() == [0, 1, 1, 1, 1]
    assert table["note"].tolist() == ["", *["beyond what was measured"] * 4]


@pytest.mark.parametrize(("question", "said"), [
    ({"sample": [9], **FREE}, "no sample 9"),
    (FREE, "samples 3, 6"),
    ({"sample": [np.nan], **FREE}, "names no sample"),
    ({"sample": [2.5], **FREE}, "whole number"),
    ({"sample": [3], "pressure_kpa": ["much"]}, "Row 1, pressure_kpa: 'much' is not a finite number"),
    ({"sample": [3, 3], "pressure_kpa": [1.0, np.inf]}, "Row 2, pressure_kpa"),
    ({"sample": [3], "pressure_1_kpa": [20.0]}, "pressure_1_kpa"),
    ({"sample": [3], "elongation_mm": [-98.42], "twist_deg": 0.0, "pressure_kpa": 0.0}, "leaves nothing"),
])  # fmt: skip
def test_a_table_that_makes_no_sense_is_told_in_a_sentence(run, question, said):
    with pytest.raises(UserError, match=said):
        run.invert(pd.DataFrame(question))


def test_a_column_twice_is_told_in_a_sentence(run):
    twice = pd.DataFrame([[3, 1.0, 2.0]], columns=["sample", "pressure_kpa", "pressure_kpa"])
    with pytest.raises(UserError, match="appears 2 times"):
        run.invert(twice)


def test_odd_but_sound_frames_are_answered(run):
    plain = run.invert(pd.DataFrame({"sample": [3], **FREE})).table()
    odd = [
        {"sample": ["3"], **{k: [str(v[0])] for k, v in FREE.items()}},
        {"sample": [3], **{k: [int(v[0])] for k, v in FREE.items()}},
        {"sample": [3], "twist_deg": [None], "elongation_mm": [None], **FREE},
        {"sample": [3], "bed": ["the old one"], "status": ["?"], "twist_deg_low": [1.0], **FREE},
        {"sample": [3], "step": [np.nan], "time_s": [np.nan], **FREE},
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for question in odd:
            table = run.invert(pd.DataFrame(question, index=[7])).table()
            np.testing.assert_allclose(table[PLACE].astype(float), plain[PLACE], rtol=1e-9)
            assert table["status"].tolist() == ["ok"]
            assert "twist_deg_low" in table


def test_no_rows_give_no_rows(run):
    answers = run.invert(pd.DataFrame({"sample": [], "pressure_kpa": [], "force_n": []}))
    assert len(answers) == 0
    assert {"solutions", "status", "extrapolated", "note"} <= set(answers.table())


def test_statuses_are_those_of_the_contract(run):
    grid_of = pd.DataFrame({"sample": 3, "elongation_mm": [0.0, 0, np.nan, np.nan, np.nan, np.nan],
                            "twist_deg": [0.0, 1e6, np.nan, np.nan, np.nan, 0.0],
                            "pressure_kpa": [1e7, 10.0, 20.0, 20.0, 1e6, np.nan],
                            "force_n": [np.nan, np.nan, 0.0, 1e9, 0.0, np.nan],
                            "moment_nmm": [np.nan, np.nan, 0.0, 0.0, 0.0, np.nan]})  # fmt: skip
    table = run.invert(grid_of).table()
    assert table["status"].tolist() == ["no_equilibrium", "no_equilibrium", "ok", "unreachable", "no_equilibrium",
                                        "unanswered"]  # fmt: skip
    assert set(table["status"]) <= STATUSES
    lost = table["status"] == "no_equilibrium"
    assert table.loc[lost, "force_n"].isna().tolist() == [True, True, False]
    assert table.loc[table["status"] != "ok", [n for n in table if n.endswith("_low")]].isna().all(axis=None)
    assert run.invert(grid_of).counts()["no_equilibrium"] == 3


def test_of_rows_with_several_solutions_all_are_listed(tmp_path):
    model = continuum(c1=2e5, c2=1e6)
    table = shown(model, grid(1, (-4.0, 0.0, 4.0), (-120.0, -60.0, 1.0, 60.0, 120.0))).dropna().reset_index(drop=True)
    answers = fitted(tmp_path, model, table).invert(table.drop(columns=[*PLACE, "step"]), bands=False)
    counts = answers.table()["solutions"]
    assert counts.max() > 1
    listed = answers.every.groupby("row").size()
    assert listed.to_dict() == counts[counts > 1].to_dict()
    # The one that is told is among them, and has the best standing.
    for row, every in answers.every.groupby("row"):
        place = answers.table().loc[row, PLACE].to_numpy(float)
        same = np.isclose(every[PLACE].to_numpy(float), place, atol=1e-9).all(1)
        assert same.sum() == 1
        assert (answers.table()["status"][row] == "ok") == bool(every.loc[same, "stable"].iloc[0] == 1)


def test_of_an_end_block_each_pressure_has_its_column(block):
    question = block.table()[[*PLACE, *LOADS]].head(3)
    table = block.invert(question).table()
    assert {f"pressure_{i}_kpa{end}" for i in (1, 2, 3) for end in ("", "_low", "_high")} <= set(table)
    assert "pressure_kpa" not in table
    # Its own predictions as questions: the members' designs beside each row.
    again = block.invert(block.table().drop(columns=LOADS).head(3)).table()
    np.testing.assert_allclose(again[LOADS], block.table()[LOADS].head(3), rtol=1e-9)
    with pytest.raises(UserError, match="pressure_4_kpa"):
        block.invert(question.assign(pressure_4_kpa=1.0))


def test_all_that_the_terminal_says_of_answers_are_sentences(run):
    loads = {"force_n": [0.0, 0.0, 0.0], "moment_nmm": [0.0, np.nan, 0.0]}
    answers = run.invert(pd.DataFrame({"sample": [3, 3, 3], "pressure_kpa": [20.0, 20.0, 1e6], **loads}))
    said = answer_lines(answers, run)
    assert said[0] == "1 of 3 rows answered"
    assert any(sentence.startswith("1 unanswered:") for sentence in said)
    assert any(sentence.startswith("row 2:") for sentence in said)
    assert "±" in answers_table(answers).text()


def test_that_pressures_are_told_between_rising_and_falling_is_said(run):
    rubs = SimpleNamespace(model=SimpleNamespace(effects=[FrictionHysteresis()]), bands=run.bands)
    asks = run.invert(run.table().drop(columns="pressure_kpa").head(3))
    assert any("friction_hysteresis goes by whether the pressure rises or falls" in s for s in answer_lines(asks, rubs))
    assert not any("rises or falls" in s for s in answer_lines(asks, run))
    loads = run.invert(run.table().drop(columns=LOADS).head(3))
    assert not any("rises or falls" in s for s in answer_lines(loads, rubs))
