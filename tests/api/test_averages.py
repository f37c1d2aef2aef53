"""What all sets of effects say together that a search found as good."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from face_runs import fitted_run, found_search, hidden_table

from freelearn import UserError
from freelearn.data.beds import KINEMATIC
from freelearn.queries.answers import Answers
from freelearn.queries.averages import averaged_answers, averaged_prediction, predictive_shares
from freelearn.queries.fitted_model import Answer

LOADS = ["force_pred_n", "moment_pred_nmm"]
QUESTIONS = ["sample", "elongation_mm", "twist_deg", "pressure_kpa"]


@pytest.fixture(scope="module")
def several():
    """The search's answer as if the model without what is missing had a quarter of the probability."""
    found = found_search()
    first, last = found.content["trail"][0], found.content["trail"][-1]
    models = [
        {"effects": [e for e in step["effects"] if e == "force_offset"], "parameters": step["parameters"],
         "probability": share, "E_heldout": 0.01, "evidence": 0.0}
        # As good on what was left out, so that the probabilities decide alone.
        for step, share in ((last, 0.6), (first, 0.2))
    ]  # fmt: skip
    return replace(found, content=found.content | {"models": models})


@pytest.fixture(scope="module")
def few():
    return hidden_table().query("pressure_kpa > 20").iloc[::13][QUESTIONS].reset_index(drop=True)


def test_one_set_alone_is_the_last_model(few):
    found = found_search()
    assert len(found.content["models"]) == 1
    pd.testing.assert_frame_equal(found.predict(few, average=True).frame(), found.predict(few).frame(), rtol=1e-9)


def test_the_mean_goes_by_the_probabilities_and_bands_grow_by_what_lies_between(several, few):
    together, last = several.predict(few, average=True).frame(), several.predict(few).frame()
    # The first model as the search fitted it, apart from the sets; 0.6 and 0.2 are three quarters and one.
    first = replace(several.fitted, model=several.first_model, covariance=np.full((2, 2), np.nan))
    first = first.predict(few, bands=False).frame()
    apart = (last[LOADS] - first[LOADS]).abs().to_numpy()
    np.testing.assert_allclose(together[LOADS], 0.75 * last[LOADS] + 0.25 * first[LOADS], rtol=1e-9)
    half = (last["force_pred_n_high"] - last["force_pred_n"]).to_numpy()
    # The standard deviation of two values with these shares is √(¾ · ¼) of what lies between them.
    wider = np.hypot(half, 1.96 * np.sqrt(3 / 16) * apart[:, 0])
    np.testing.assert_allclose(together["force_pred_n_high"] - together["force_pred_n"], wider, rtol=1e-9)
    assert np.median(wider / half) > 1.2


def test_whatever_is_blank_is_answered_together(several, few):
    asked = few.assign(pressure_kpa=np.nan, force_n=several.predict(few)["force_pred_n"].to_numpy())
    together, last = several.invert(asked, average=True), several.invert(asked)
    alone = [each.invert(asked, bands=False)["pressure_kpa"].to_numpy() for _, each in several.sets]
    every = [last, *(each.invert(asked, bands=False) for _, each in several.sets)]
    known = np.all([(each["status"] == "ok").to_numpy() for each in every], axis=0)
    assert known.sum() > 5
    mean = 0.75 * alone[0] + 0.25 * alone[1]
    np.testing.assert_allclose(together["pressure_kpa"].to_numpy()[known], mean[known], rtol=1e-9)
    assert (together["force_n"] == asked["force_n"]).all()
    assert (together["status"] == last["status"]).all()


def test_of_two_sets_as_probable_the_one_that_predicts_better_counts_more():
    """n normal errors with a deviation σ that is not known: their likelihood, with σ integrated over dσ/σ, goes as
    (Σ e²)^(−n/2)."""
    random = np.random.default_rng(1)
    errors = [random.normal(0, deviation, 6) for deviation in (1.0, 1.3)]
    sigmas = np.geomspace(1e-2, 1e2, 4001)
    each = [np.trapezoid(np.exp(-0.5 * (e @ e) / sigmas**2) / sigmas**7, sigmas) for e in errors]
    shares = predictive_shares([0.5, 0.5], [float(np.sqrt(np.mean(e**2))) for e in errors], 6)
    assert shares[1] / shares[0] == pytest.approx(each[1] / each[0], rel=1e-6)
    # What could not be left out is null in discovery.json.
    assert predictive_shares([0.7, 0.3], [np.nan, None], 6) == [0.7, 0.3]
    assert predictive_shares([0.7, 0.3], [None, 0.1], 6) == [0.0, 0.3]


def prediction(force, status, half=1.0):
    loads = np.stack([np.array(force, float), np.zeros(len(force))], axis=1)
    return Answer(loads, np.full(loads.shape, 0.5), np.full(loads.shape, half), list(status), KINEMATIC)


def test_where_half_of_the_sets_or_the_last_model_have_no_answer_the_last_ones_stands():
    last = prediction([1.0, 2.0, np.nan], ["ok", "ok", "no_equilibrium"])
    one = prediction([3.0, np.nan, 5.0], ["ok", "no_equilibrium", "ok"])
    other = prediction([np.nan, 4.0, 5.0], ["singular", "ok", "ok"])
    together = averaged_prediction(last, [one, other], [0.7, 0.3])
    np.testing.assert_array_equal(together.loads[:, 0], [3.0, 2.0, np.nan])
    assert together.status == last.status
    np.testing.assert_allclose(together.half[:, 0], 1.0)


def test_of_a_table_rows_without_an_answer_stay_as_the_last_model_left_them():
    def table(force, status):
        filled = pd.DataFrame({"force_n": force, "status": status})
        return Answers(filled.assign(force_n_low=0.0, force_n_high=2.0), pd.DataFrame(), ("force_n",))

    last = table([1.0, np.nan], ["ok", "unreachable"])
    together = averaged_answers(last, [table([2.0, 9.0], ["ok"] * 2), table([4.0, 9.0], ["ok"] * 2)], [0.5, 0.5])
    assert together["force_n"].tolist()[0] == 3.0
    assert np.isnan(together["force_n"][1])
    # Half of the band 1 beside a deviation of 1, 1.96 times.
    assert together["force_n_high"][0] - 3.0 == pytest.approx(np.hypot(1.0, 1.96))


def test_bands_are_never_narrower_than_the_last_models(several, few):
    """Of the other sets nobody knows how far they miss states that were left out."""
    for average, last in ((several.predict(few, average=True), several.predict(few)),
                          (found_search().predict(few, average=True), found_search().predict(few))):  # fmt: skip
        assert (average.half >= last.half * (1 - 1e-12)).all()


def test_the_command_answers_as_the_function_does_and_asks_it_of_a_search_alone(few, commands, tmp_path):
    found, path = found_search(), tmp_path / "questions.csv"
    few.to_csv(path, index=False)
    words = [f"data.path={path}", "average=true", f"hydra.run.dir={tmp_path / 'out'}"]
    done = commands.run("predict", f"run={found.folder}", *words)
    assert done.status == 0, done.told
    written = pd.read_csv(tmp_path / "out" / "answers.csv")
    expected = found.invert(few, average=True).frame()
    np.testing.assert_allclose(written["force_n"], expected["force_n"], rtol=1e-8)
    refused = commands.run("predict", f"run={fitted_run().folder}", *words)
    assert refused.status == 1
    assert "average=true is asked of a search" in refused.err


def test_a_set_with_an_effect_that_nobody_knows_here_is_left_out(several, few):
    strange = {"effects": ["nobody_knows"], "parameters": {}, "probability": 0.9, "E_heldout": 0.001}
    more = replace(several, content=several.content | {"models": [*several.content["models"], strange]})
    assert len(more.sets) == 2
    pd.testing.assert_frame_equal(more.predict(few, average=True).frame(), several.predict(few, average=True).frame())
    with pytest.raises(UserError, match="lacks the columns"):
        more.predict(few[["sample"]], average=True)
