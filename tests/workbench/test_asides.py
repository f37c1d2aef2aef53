"""What is asked of a finished run on the page is what the commands answer."""

import json
from dataclasses import replace
from html import unescape
from pathlib import Path
from types import SimpleNamespace

import fitted_folders as folders
import numpy as np
import pandas as pd
import pytest

import freelearn
from freelearn.workbench.panels.asides import Planning, Sides
from freelearn.workbench.panels.predicting import Predicting
from freelearn.workbench.panels.rubber_panel import Rubber
from freelearn.workbench.panels.sweeps import Sweeps
from freelearn.workbench.state import job_work
from freelearn.workbench.state.session import Sessions

# What Panel 2 will call otherwise is called as Panel 1.5 has it, all over the page.
pytestmark = pytest.mark.filterwarnings("ignore:.* will be removed in version 2:PendingDeprecationWarning")


class InProcess:
    """A job that is done here, at once."""

    def __init__(self, kind, question, folder, fits):
        self.kind, self.folder, self.status, self.text, self.share = kind, folder, "running", "", None
        folder.mkdir(parents=True, exist_ok=True)
        job_work.JOBS[kind](question, folder, fits, SimpleNamespace(send=lambda told: None))

    def poll(self):
        self.status = "done"
        return True

    def cancel(self):
        pass


@pytest.fixture
def session(sessions, monkeypatch):
    monkeypatch.setattr("freelearn.workbench.state.running.Job", InProcess)
    session = sessions.get("")[1]
    table = folders.shown(folders.continuum(), folders.grid())
    folders.folder_of(session.folder / "train_x", folders.continuum(), table)
    session.runs = [{"folder": "train_x", "question": session.question}]
    return session


def test_a_blank_is_filled_as_the_command_fills_it(session, tmp_path):
    page = Predicting(session)
    page.refresh()
    assert (page.sample.value, list(page.fields)[:3]) == (3, ["elongation_mm", "twist_deg", "pressure_kpa"])
    for name, text in {"elongation_mm": "−2,5", "twist_deg": "10", "pressure_kpa": " 30 "}.items():
        page.fields[name].value = text
    page.asked()
    session.poll()
    page.refresh()
    answer = pd.read_csv(page.save.file)
    row = {"sample": [3], "elongation_mm": [-2.5], "twist_deg": [10.0], "pressure_kpa": [30.0]}
    expected = freelearn.load(session.folder / "train_x").invert(pd.DataFrame(row)).frame()
    assert answer["status"].tolist() == ["ok"]
    assert answer["force_n"][0] == pytest.approx(expected["force_n"][0], rel=1e-6)
    assert "moment N·mm" in page.answer.object
    assert "1 of 1 answered" in page.said.object
    for words in (f"run={session.folder.resolve() / 'train_x'}", "python predict.py", "fl.load("):
        assert words in page.lines.object.replace("&#39;", "'")
    # It outlives the page.
    again = Sessions(session.folder.parent).get(session.folder.name)[1]
    assert again.asides["predict"]["question"].asks == session.asides["predict"]["question"].asks


def test_what_is_no_number_is_said(session):
    page = Predicting(session)
    page.refresh()
    page.fields["twist_deg"].value = "<b>ten"
    page.asked()
    assert session.asides == {}
    assert "twist" in page.wrong.object
    assert "<b>ten" not in page.wrong.object


def test_nothing_is_asked_before_a_fit(sessions):
    session = sessions.get("")[1]
    for page in (Predicting(session), Planning(session)):
        page.refresh()
        assert page.go.disabled
        assert "Fit a model first" in page.said.object
    session.ask("plan", rows=3)
    assert session.job is None


def test_a_plan_has_as_many_rows_as_were_asked_for(session, monkeypatch):
    # How rows are chosen is tested where it is done.
    def four(question, folder, *_):
        folders.grid().head(question.rows).to_csv(folder / "plan.csv", index=False)
        (folder / "plan.json").write_text(json.dumps({"says": "4 rows <b>tell</b>", "certificate_says": "Most of it."}))

    monkeypatch.setitem(job_work.JOBS, "plan", four)
    page = Planning(session)
    page.refresh()
    page.rows.value = 4
    page.asked()
    session.poll()
    page.refresh()
    assert len(pd.read_csv(Path(page.save.file))) == 4
    assert "rows=4" in page.lines.object
    assert "4 rows &lt;b&gt;" in page.said.object
    # What every row has alike is in the file alone.
    assert "gamma" not in page.answer.object
    assert "pressure kPa" in page.answer.object
    # Of a later fit it is no answer.
    folders.folder_of(
        session.folder / "train_y", folders.continuum(), folders.shown(folders.continuum(), folders.grid())
    )
    session.runs = [{"folder": "train_y", "question": session.question}]
    page.refresh()
    assert "earlier fit" in page.said.object


def test_the_rubber_of_three_files_is_fitted(session):
    page = Rubber(session)
    page.refresh()
    assert page.go.disabled
    stretch = np.linspace(1.05, 2.0, 12)
    # Nominal stress of a neo-Hookean solid with C1 = 0.4 MPa, W = C1/2 (I1 - 3), as laboratories write it.
    for name, power in {"Zug.csv": -2.0, "equi.csv": -5.0, "<b>c.csv": -3.0}.items():
        rows = pd.DataFrame({"Dehnung [%]": 100 * (stretch - 1), "Spannung [kPa]": 400 * (stretch - stretch**power)})
        session.add_tests(name, rows.to_csv(index=False).encode())
        session.poll()
        page.refresh()
    assert "2  equi.csv: equibiaxial, 12 rows" in page.given.object
    assert "&lt;b&gt;c.csv: which loading?" in page.given.object
    page.asked()
    assert "still to be said" in page.wrong.object
    answers = {"3.mode": "pure_shear", **{f"{n}.stress.kind": "stress_mpa" for n in (1, 2, 3)}}
    for key, value in answers.items():
        page.questions.fields[key].value = value
    page.effects.value = ["wall_stiffening"]
    page.asked()
    session.poll()
    page.refresh()
    found = json.loads(Path(page.save.file).read_text())["parameters"]
    assert found["C1"]["value"] == pytest.approx(0.4e6, rel=1e-3)
    assert page.picture.visible
    # The lines of Python run as they stand, and take the rubber over.
    lines = page.lines.object.rsplit("<pre", 1)[1].split(">", 1)[1].removesuffix("</pre>")
    said = unescape(lines).splitlines()
    assert said[0] == "import freelearn as fl"
    run = eval(said[1], {"fl": freelearn})
    assert run.frame().loc["C1", "value"] == pytest.approx(found["C1"]["value"], rel=1e-12)
    assert "python -m freelearn start Zug.csv equi.csv" in page.lines.object
    assert "spannung" in Path(page.recipe.file).read_text().lower()
    assert Path(page.report.file).exists()
    again = Rubber(session)
    again.refresh()
    assert (again.tests, again.effects.value) == (page.tests, ["wall_stiffening"])
    again.anew.clicks += 1
    again.refresh()
    assert again.go.disabled


def test_a_laboratorys_trajectory_is_answered(session):
    page = Predicting(session)
    page.refresh()
    lines = "".join(f"{t};{2 * t};{-2 * t}\n" for t in range(5))
    page._dropped("Bahn <b>.csv", f"Zeit [s];Weg [mm];Kraft [N]\n{lines}".encode())
    session.poll()
    page.refresh()
    form = page.laboratory
    assert form.view.visible
    assert "Bahn &lt;b&gt;.csv: 5 rows" in form.about.object
    form.go.clicks += 1
    assert "a positive force is a pull: still to be said" in form.wrong.object
    form.questions.fields["sign.Kraft [N]"].value = "yes"
    form.questions.fields["given.twist_deg"].value = "0"
    assert {"given.pressure_kpa", "given.moment_nmm"} <= set(form.questions.fields)
    form.go.clicks += 1
    session.poll()
    page.refresh()
    asked = pd.read_csv(Path(page.save.file).with_name("questions.csv"))
    assert list(asked) == ["sample", "time_s", "elongation_mm", "twist_deg", "force_n"]
    assert asked["force_n"].tolist() == [0, 2, 4, 6, 8]
    answer = pd.read_csv(page.save.file)
    assert len(answer) == 5
    expected = freelearn.load(session.folder / "train_x").invert(asked).frame()
    np.testing.assert_allclose(answer["pressure_kpa"], expected["pressure_kpa"], rtol=1e-6)
    assert "--recipe" in page.lines.object
    assert "asks: [pressure_kpa, moment_nmm]" in Path(page.recipe.file).read_text()


def test_a_table_of_questions_is_answered_at_once(session):
    page = Predicting(session)
    page.refresh()
    page._dropped("mine.csv", b"elongation_mm,twist_deg,pressure_kpa\n1,0,20\n2,0,20\n3,0,20\n")
    session.poll()
    page.refresh()
    session.poll()
    page.refresh()
    assert not page.laboratory.view.visible
    assert len(pd.read_csv(page.save.file)) == 3
    assert page.picture.visible


def test_two_fits_stand_side_by_side(session):
    page = Sides(session)
    page.refresh()
    assert page.go.disabled
    model = folders.continuum()
    folders.folder_of(session.folder / "train_y", model, folders.shown(model, folders.grid()))
    session.runs = [
        *session.runs,
        {"folder": "train_y", "question": replace(session.question, effects=("end_clamps",))},
    ]
    page.refresh()
    assert list(page.one.options) == ["1  continuum, on sample3", "2  continuum + end_clamps, on sample3"]
    assert (page.one.value, page.other.value) == ("train_x", "train_y")
    page.other.value = "train_x"
    page.asked()
    assert "the same fit" in page.wrong.object
    page.other.value = "train_y"
    page.asked()
    session.poll()
    page.refresh()
    assert "Errors on the same rows" in page.answer.object
    assert Path(page.save.file).name == "comparison.html"
    assert "python -m freelearn compare" in page.lines.object


@pytest.mark.slow
def test_a_study_is_run_and_shown(session, tmp_path):
    page = Sweeps(tmp_path / "nothing", session)
    page.refresh()
    assert page.studying.trains.value == session.sets
    page.studying.trains.value = []
    page.studying.asked()
    assert "Tick a model" in page.studying.wrong.object
    page.studying.models.value, page.studying.trains.value = ["linear"], ["sample3", "sample6"]
    # What no fit can be made of is said before, not left out of the maps.
    asked, session.question = session.question, replace(session.question, effects=("fiber_tension_only",))
    page.studying.asked()
    assert "cannot join model &#39;linear&#39;" in page.studying.wrong.object
    assert not session.busy
    session.question = asked
    page.studying.asked()
    assert not page.studying.wrong.object
    session.poll()
    page.refresh()
    table = pd.read_csv(page.choice.value)
    assert set(table["train"]) == {"sample3", "sample6"}
    assert set(table["test"]) >= {"sample1", "even", "all"}
    assert len(page.maps.objects) == 1
    assert "python train.py -m model=linear train=sample3,sample6" in page.studying.lines.object
    # What was fitted is found again.
    alone = json.loads(next(page.choice.value.parent.glob("linear_sample3*/results.json")).read_text())
    fitted = freelearn.fit("virtual", model="linear", train="sample3", split="states", progress=False)
    assert alone["tests"]["sample6"]["E"] == pytest.approx(fitted.errors.loc["sample6", "E"], rel=1e-12)
    # A click on a cell shows its run's curves, of the test set's states, worst first.
    heat = page.maps.objects[0].object
    cells = heat.renderers[0].data_source
    (place,) = [
        n
        for n, pair in enumerate(zip(cells.data["train"], cells.data["test"], strict=True))
        if pair == ("sample3", "sample6")
    ]
    assert page.curves is None
    cells.selected.indices = [place]
    assert page.curves.view.visible
    error = 100 * alone["tests"]["sample6"]["E"]
    assert f"E {error:.3g} %" in page.curves.said.object
    predictions = pd.read_csv(next(page.choice.value.parent.glob("linear_sample3*/predictions.csv")))
    assert page.curves.labels
    assert all(text.startswith("sample 6, ") for text in page.curves.labels.values())
    missed = (predictions["force_n"] - predictions["force_pred_n"]).where(predictions["sample"] == 6).abs()
    worst = predictions.loc[page.curves.fit.rows(list(page.curves.labels)[page.curves.slider.value])]
    assert set(worst["sample"]) == {6}
    shown = page.curves.charts.rows[0].data["force_n"]
    assert set(shown) <= set(worst["force_n"])
    assert missed[worst.index].mean() > missed.mean()
    page.curves.slider.value = 0
    assert page.curves.slider.title.startswith("kinematic state (sample 6, ")
    # Of a run that is gone it is said.
    for path in page.choice.value.parent.glob("linear_sample6*/results.json"):
        path.unlink()
    cells.selected.indices = [list(cells.data["train"]).index("sample6")]
    assert "cannot be shown" in page.hint.object
    assert not page.curves.view.visible
