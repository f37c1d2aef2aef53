"""What fit, discover, plan and referee give: tables, pictures on matplotlib's axes, folders like the command's."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from face_runs import fitted_run, found_search, hidden_table
from matplotlib import pyplot
from matplotlib.axes import Axes
from sklearn.base import clone
from sklearn.model_selection import GroupKFold, cross_val_score
from small_runs import run as trained

import freelearn as fl
from freelearn.data.states import kinematic_state


@pytest.fixture(scope="module")
def table():
    return hidden_table()


@pytest.fixture(scope="module")
def run():
    return fitted_run()


@pytest.fixture(scope="module")
def found():
    return found_search()


@pytest.fixture(autouse=True)
def quiet(monkeypatch):
    """No picture is shown by itself, and none is left open."""
    monkeypatch.setattr(pyplot, "show", lambda *_: pytest.fail("a picture was shown"))
    yield
    pyplot.close("all")


def documents(*folders: Path, name: str) -> list[dict]:
    """Without how long it took, where the table lay, and what depends on it."""
    read = [json.loads((folder / name).read_text()) for folder in folders]
    for each in read:
        for key in ("seconds", "fit_seconds", "key", "digest"):
            each.pop(key, None)
        each["data"].pop("path")
    return read


def test_a_saved_fit_is_that_of_the_command_to_the_last_bit(run, table, tmp_path):
    table.to_csv(tmp_path / "mine.csv", index=False)
    data = ["data=csv", f"data.path={tmp_path / 'mine.csv'}", "train=all", "seed=3", "figures=false"]
    trained(tmp_path / "command", *data, "effects=[force_offset]")
    saved = run.save(tmp_path / "saved")
    for name in ("predictions.csv", "checkpoint.ckpt", "fit_report.txt"):
        assert (saved / name).read_bytes() == (tmp_path / "command" / name).read_bytes(), name
    ours, commands = documents(saved, tmp_path / "command", name="results.json")
    assert ours == commands
    again = fl.load(saved)
    assert again.parameters == run.parameters
    pd.testing.assert_frame_equal(again.predict(table.head(4)).frame(), run.predict(table.head(4)).frame())
    with pytest.raises(fl.UserError, match="holds a run already"):
        run.save(saved)
    with pytest.raises(fl.UserError, match="not known in this session"):
        again.get_params()


def test_a_saved_search_is_taken_up_again_as_it_was(found, table, tmp_path):
    again = fl.load(found.save(tmp_path / "saved"))
    assert isinstance(again, fl.Found)
    assert (again.verdict, again.effects, again.content) == (found.verdict, found.effects, found.content)
    few = table.head(3)
    np.testing.assert_array_equal(again.predict(few).loads, found.predict(few).loads)
    assert again.parameters == found.parameters
    # The curves of the first model and of the last, whether they come from the session or from the folder.
    for kept, fresh in zip(again.state_curves, found.state_curves, strict=True):
        for when in ("before", "after"):
            both = [curves[1][when]["force_pred_n"] for curves in (kept, fresh)]
            np.testing.assert_allclose(*both, rtol=1e-6, atol=1e-6)


def test_tables_of_a_run(run):
    frame = run.frame()
    assert frame.loc["force_offset.force", "value"] == run.parameters["force_offset.force"]
    stderr = np.sqrt(np.diag(run.covariance))[list(run.parameters).index("C2")]
    assert frame.loc["C2", "stderr"] == pytest.approx(stderr)
    assert (frame["low"] < frame["value"]).all()
    assert run.errors.loc["all", "n"] > 0
    assert "force_offset.force" in run.summary()
    assert "C1 = " in repr(run)
    assert len(run._repr_html_()) < 3000


def test_an_answer_is_a_table_beside_the_rows_that_were_asked(run, table):
    rows = table.iloc[::100].set_index("step", drop=False).rename_axis("row")
    answer = run.predict(rows)
    frame = answer.frame()
    assert frame.index.tolist() == rows.index.tolist()
    assert frame["pressure_kpa"].tolist() == rows["pressure_kpa"].tolist()
    np.testing.assert_allclose(frame["force_pred_n"], answer.loads[:, 0])
    assert answer["status"].tolist() == answer.status
    assert len(answer) == len(rows)
    # As predict.py fills it in, where the model is asked for the force.
    blank = rows.assign(force_n=np.nan, moment_nmm=np.nan)
    np.testing.assert_allclose(run.invert(blank).table()["force_n"], answer.loads[:, 0], rtol=1e-9)


def test_a_score_is_the_error_of_the_command(run):
    own = run.table()
    tested = own[own["split"] == "test"]
    assert run.error(tested) == pytest.approx(run.errors.loc["all", "E"], rel=1e-6)
    assert run.score(tested) == -run.error(tested)
    with pytest.raises(fl.UserError, match="no reading"):
        run.error(tested.assign(force_n=np.nan, moment_nmm=np.nan))


def test_scikit_learn_clones_and_scores_it(run, table):
    again = clone(run)
    assert isinstance(again, fl.Estimator)
    assert clone(again).get_params() == run.get_params()
    assert clone(again).set_params(seed=5).get_params()["seed"] == 5
    assert again.fit(table).run_.parameters == run.parameters
    with pytest.raises(fl.UserError, match="fit"):
        clone(again).predict(table)
    folds = GroupKFold(2).split(table, groups=kinematic_state(table))
    scores = cross_val_score(fl.Estimator(model="linear", progress=False), table, cv=folds)
    assert (scores < 0).all()


def test_pictures_of_a_run(run):
    for draw in (run.plot.parity, run.plot.residuals):
        force, moment = draw()
        assert force is not moment
        assert force.has_data()
        _, one = pyplot.subplots()
        assert draw(ax=one, quantity="moment") is one
        assert one.has_data()
    assert len(run.plot.curves("best")) == 3
    _, three = pyplot.subplots(1, 3)
    assert list(run.plot.curves(ax=three)) == list(three)
    assert isinstance(run.plot.heatmap(), Axes)


def test_a_picture_draws_what_the_table_holds(run):
    (force, _) = run.plot.parity()
    drawn = np.concatenate([line.get_xdata() for line in force.get_lines() if line.get_label() in ("train", "test")])
    own = run.table()
    read = own.loc[own["split"].isin(["train", "test"]), "force_n"]
    np.testing.assert_allclose(np.sort(drawn), np.sort(read))


def test_pictures_of_a_search(found):
    staircase = found.plot.staircase()
    steps = next(line for line in staircase.get_lines() if line.get_label() == "held-out error")
    np.testing.assert_allclose(steps.get_ydata(), 100 * found.frame()["E_heldout"])
    assert "force_offset" in [label.get_text() for label in found.plot.ranking().get_yticklabels()]
    assert len(found.plot.residuals("before")) == 2
    assert len(found.plot.curves(2)) == 3
    assert found.plot.parity(quantity="force").get_ylabel().startswith("predicted force")


def test_a_wrong_picture_says_what_there_is(run, found):
    _, one = pyplot.subplots()
    for draw, says in (
        (lambda: run.plot.parity(ax=one), "2 panels"),
        (lambda: run.plot.parity(quantity="torque"), "force, moment"),
        (lambda: run.plot.curves("odd"), "middling"),
        (lambda: found.plot.curves(9), "choose 1"),
        (lambda: found.plot.residuals("later"), "before or after"),
    ):
        with pytest.raises(fl.UserError, match=says):
            draw()


def test_a_run_is_planned_from_and_refereed(found, tmp_path):
    planned = fl.plan(found, rows=4, goal="narrow", parameter="C1")
    assert len(planned.frame()) == 4
    assert "of the best plan" in planned.summary() or "of what any plan" in planned.summary()
    assert planned.plot.places().has_data()
    assert {path.name for path in planned.save(tmp_path / "plan", figures=False).iterdir()} == {"plan.csv", "plan.json"}
    refereed = fl.referee(found)
    assert refereed.frame().set_index("name")["result"].isin(["pass", "fail", "cannot_tell"]).all()
    assert "named" in refereed.summary()
    with pytest.raises(fl.UserError, match="is no run"):
        fl.plan(3, rows=4)


@pytest.mark.nightly
def test_a_search_asked_again_in_the_session_goes_on_where_it_was(table, monkeypatch):
    """Interrupted after its first step, it has kept what it had fitted."""
    from freelearn.api.tasks import discover_task as task

    class Interrupted(BaseException):
        pass

    made = []
    search = task.search

    def stopping(question, *asked):
        def step(*told):
            made.append(told)
            raise Interrupted

        return search(question, step)

    monkeypatch.setattr(task, "search", stopping)
    with pytest.raises(Interrupted):
        fl.discover(table, checks="off", seed=11)
    monkeypatch.setattr(task, "search", search)
    assert made
    kept, journal = [], task.Progress.journal

    def watched(progress):
        taken_up = journal(progress)
        kept.append(len(taken_up.entries))
        return taken_up

    monkeypatch.setattr(task.Progress, "journal", watched)
    assert fl.discover(table, checks="off", seed=11).verdict == "named"
    assert kept[0] > 0
