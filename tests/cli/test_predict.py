"""`python predict.py`: from the folder of a run and a table with blanks to answers.csv."""

import subprocess
import sys

import beds
import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from hidden_tables import table as hidden
from nightly import usually
from rich.console import Console
from small_runs import make_csv, run

import freelearn
from freelearn.api.settings.configuration import settings
from freelearn.api.settings.run_settings import PredictSettings, QuestionsData
from freelearn.api.settings.settings import DiscoverSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.cli.run_commands import predict, predict_app
from freelearn.common.errors import UserError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
STATUSES = {"ok", "no_equilibrium", "singular", "overstretched", "unstable", "unreachable", "unanswered"}
PLACE, LOADS = ["elongation_mm", "twist_deg"], ["force_n", "moment_nmm"]


def ask(folder, text, out, **more):
    """What `predict` writes to `out` and says, of questions as text."""
    path = out.parent / "questions.csv"
    path.write_text(text)
    said = out.parent / "terminal.txt"
    with open(said, "w") as file:
        asked = PredictSettings(run=folder, data=QuestionsData(path=path), **more)
        predict(asked, out, Console(file=file, width=200))
    return said.read_text()


def command_line(monkeypatch, tmp_path, *words):
    """Runs `predict.py words` in this process; what it exits with, None where it ends well."""
    monkeypatch.setattr(sys, "argv", ["predict.py", *words, f"hydra.run.dir={tmp_path / 'out'}"])
    try:
        predict_app()
    except SystemExit as end:
        return end.code
    return None


@pytest.fixture(scope="module")
def csv(tmp_path_factory):
    return make_csv(tmp_path_factory.mktemp("table") / "table.csv", rows=1200)


@pytest.fixture(scope="module")
def trained(csv, tmp_path_factory):
    folder = tmp_path_factory.mktemp("trained") / "run"
    run(folder, "train=all", "data=csv", f"data.path={csv}", "figures=false")
    return folder


def test_the_rows_come_back_in_their_order_with_their_blanks_filled(trained, tmp_path):
    text = "name,sample,elongation_mm,twist_deg,pressure_kpa,force_n,moment_nmm\n" \
           "loads,3,1,20,30,,\npose,6,,,40,0,0\ncommand,3,,-8,,0,0\nopen,3,,,,,\nloads,6,-1,-20,10,,\n"  # fmt: skip
    said = ask(trained, text, tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "answers.csv")
    assert table["name"].tolist() == ["loads", "pose", "command", "open", "loads"]
    assert table["status"].tolist()[3] == "unanswered"
    assert set(table["status"]) <= STATUSES
    assert table["force_n"].notna().tolist() == [True, True, True, False, True]
    filled = {"loads": LOADS, "pose": PLACE, "command": ["elongation_mm", "pressure_kpa"], "open": []}
    for i, name in enumerate(table["name"]):
        for column in [*PLACE, "pressure_kpa", *LOADS]:
            assert np.isfinite(table[f"{column}_low"][i]) == (column in filled[name]), (name, column)
    columns = list(table)
    for column in [*PLACE, "pressure_kpa", *LOADS]:
        at = columns.index(column)
        assert columns[at + 1 : at + 3] == [f"{column}_low", f"{column}_high"]
    assert columns[-4:] == ["solutions", "status", "extrapolated", "note"]
    assert "4 of 5 rows answered" in said
    assert "1 unanswered" in said
    # As Python says it.
    question = pd.read_csv(tmp_path / "questions.csv")
    again = freelearn.load(trained).invert(question).table()
    numbers = table.select_dtypes("number").columns
    np.testing.assert_allclose(table[numbers], again[numbers].astype(float), rtol=1e-9)
    # Answers are questions that hold no blank: they come back as they are.
    ask(trained, (tmp_path / "out" / "answers.csv").read_text(), tmp_path / "again")
    twice = pd.read_csv(tmp_path / "again" / "answers.csv")
    whole = table["status"] == "ok"
    np.testing.assert_allclose(twice.loc[whole, [*PLACE, *LOADS]], table.loc[whole, [*PLACE, *LOADS]])


def test_the_command_runs_in_a_process_of_its_own(trained, tmp_path):
    (tmp_path / "questions.csv").write_text("sample,pressure_kpa,force_n,moment_nmm\n3,20,0,0\n")
    out = tmp_path / "out"
    words = [f"run={trained}", "data.path=questions.csv", f"hydra.run.dir={out}"]
    done = subprocess.run([sys.executable, ROOT / "predict.py", *words], cwd=tmp_path, capture_output=True, text=True,
                          timeout=120, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "1 of 1 rows answered" in done.stdout
    assert [p.name for p in out.iterdir()] == ["answers.csv"]


@pytest.mark.parametrize(("words", "said"), [
    (["data.path=questions.csv"], "run is missing"),
    (["run={run}"], "data.path=QUESTIONS.csv"),
    (["run=nowhere", "data.path=questions.csv"], "No folder at nowhere"),
    (["run={here}", "data.path=questions.csv"], "not the folder of a whole run"),
    (["run={run}", "data.path=absent.csv"], "absent.csv"),
    (["run={run}", "data.path={here}"], "questions|folder|file"),
    (["run={run}", "data.path=broken.csv"], "line 2, force_n: 'abc' is not a number"),
    (["run={run}", "data.path=questions.csv", "bands=perhaps"], "bands"),
    (["run={run}", "data.path=unknown.csv"], "no sample 9"),
])  # fmt: skip
def test_a_mistake_is_told_in_a_sentence_and_nothing_is_written(trained, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "questions.csv").write_text("sample,pressure_kpa,force_n,moment_nmm\n3,20,0,0\n")
    (tmp_path / "broken.csv").write_text("sample,pressure_kpa,force_n\n3,20,abc\n")
    (tmp_path / "unknown.csv").write_text("sample,pressure_kpa,force_n,moment_nmm\n3,20,0,0\n9,20,0,0\n")
    told = command_line(monkeypatch, tmp_path, *(word.format(run=trained, here=tmp_path) for word in words))
    assert str(told).startswith("error: ")
    assert said in str(told) or any(part in str(told) for part in said.split("|"))
    assert not (tmp_path / "out").exists()


def test_all_solutions_stand_in_a_file_of_their_own(tmp_path):
    """And none is left of an earlier run into the same folder."""
    run(tmp_path / "run", "data=virtual", "train=sample1", "fit=none", "model.C1=2e5", "model.C2=1e6", "figures=false",
        "test=sample1")  # fmt: skip
    several = "sample,pressure_kpa,force_n,moment_nmm\n"
    fitted = freelearn.load(tmp_path / "run")
    rows = fitted.predict(pd.DataFrame({"sample": 1, "elongation_mm": [0.0, 1.0], "twist_deg": [20.0, 30.0],
                                        "pressure_kpa": 51.785714}), bands=False)  # fmt: skip
    for force, moment in rows.loads.tolist():
        several += f"1,51.785714,{force!r},{1e3 * moment!r}\n"
    ask(tmp_path / "run", several, tmp_path / "out", bands=False)
    table, every = (pd.read_csv(tmp_path / "out" / name) for name in ("answers.csv", "solutions.csv"))
    assert (table["solutions"] > 1).all()
    assert every.groupby("row").size().tolist() == table["solutions"].tolist()
    assert {"row", *PLACE, "pressure_kpa", *LOADS, "stable", "status"} == set(every)
    ask(tmp_path / "run", "sample,elongation_mm,twist_deg,pressure_kpa\n1,0,0,10\n", tmp_path / "out", bands=False)
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["answers.csv"]


@pytest.mark.nightly
def test_a_search_s_folder_answers_with_what_it_found(tmp_path):
    path = tmp_path / "table.csv"
    hidden({"end_clamps": {"clamp_length": 6e-3}}, share=0.03).to_csv(path, index=False)
    asked = settings(DiscoverSettings, ["data=csv", f"data.path={path}", "figures=false"])
    with open(tmp_path / "terminal.txt", "w") as file:
        found = discover(asked, tmp_path / "found", Console(file=file))
    ask(tmp_path / "found", "sample,pressure_kpa,force_n,moment_nmm\n3,40,0,0\n6,40,0,0\n", tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "answers.csv")
    assert (table["status"] == "ok").all()
    assert table[[f"{name}_low" for name in PLACE]].notna().all(axis=None)
    fitted = freelearn.load(tmp_path / "found")
    assert [effect.name for effect in fitted.model.effects] == found.content["effects"]


PULLED = "sample,elongation_mm,twist_deg,pressure_kpa,force_n,moment_nmm\n1,-3,0,150,,\n1,-3,0,,-20,\n"
QUESTIONS = {
    "isometric": (PULLED, ["force_n"]),
    "dead_load": ("sample,pressure_kpa,force_n,moment_nmm\n1,20,0,30\n2,20,0,30\n", ["twist_deg"]),
    "inflation": ("elongation_mm,twist_deg,pressure_kpa\n1,10,40\n", ["force_n", "outer_diameter_mm"]),
    "block": ("elongation_mm,twist_deg,force_n,moment_nmm\n1,10,-20,0\n", [f"pressure_{i}_kpa" for i in (1, 2, 3)]),
}


@pytest.mark.parametrize("bed", usually(*(bed for bed in QUESTIONS if bed != "dead_load"), nightly=["dead_load"]))
@pytest.mark.parametrize("model", ["continuum", "mlp"])
def test_runs_on_every_bed_answer(bed, model, tmp_path):
    few = ["fit.restarts=2", "fit.max_epochs=60"] if model == "mlp" else []
    overrides = beds.write(bed, {}, tmp_path)
    if model == "mlp" and bed in ("dead_load", "inflation"):
        # A network wants more rows than it has weights.
        table = pd.concat([beds.TABLES[bed]({}, seed) for seed in range(3)], ignore_index=True)
        table.to_csv(tmp_path / f"{bed}.csv", index=False)
    run(tmp_path / "run", *overrides, "train=all", f"model={model}", *few, "figures=false")
    text, filled = QUESTIONS[bed]
    ask(tmp_path / "run", text, tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "answers.csv")
    assert len(table) == text.count("\n") - 1
    assert set(table["status"]) <= STATUSES
    assert set(filled) <= set(table)
    if model == "continuum":
        assert table["status"][0] in ("ok", "unreachable")
        assert table.loc[table["status"] == "ok", filled].notna().all(axis=None)
    if bed == "isometric" and model == "mlp":
        # Which moment there was the network was never shown.
        assert table["moment_nmm"].isna().all()
    if bed == "inflation" and model == "continuum":
        assert 2 * 6.4 * 0.8 < table["outer_diameter_mm"][0] < 2 * 6.4 * 1.5
        assert np.isfinite(table["outer_diameter_mm_low"][0])


@pytest.mark.parametrize("model", ["linear", "mlp"])
def test_other_models_answer(model, csv, tmp_path):
    few = ["fit.restarts=2", "fit.max_epochs=100"] if model == "mlp" else []
    run(tmp_path / "run", "train=all", "data=csv", f"data.path={csv}", f"model={model}", *few, "figures=false")
    rows = "3,1,20,30,,\n6,,,40,0,0\n6,-1,-10,,,2\n"
    ask(tmp_path / "run", f"sample,elongation_mm,twist_deg,pressure_kpa,force_n,moment_nmm\n{rows}", tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "answers.csv")
    assert table["status"][0] == "ok"
    assert np.isfinite(table["force_n_low"][0])
    assert set(table["status"]) <= STATUSES
    # A network trained the other way stands beside the inversion of the other, where a place was asked for.
    beside = [f"{name}_network" for name in PLACE]
    assert set(beside) & set(table) == (set(beside) if model == "mlp" else set())
    if model == "mlp":
        assert table[beside[0]].notna().tolist() == [False, True, False]
        assert list(table).index(beside[0]) < list(table).index("solutions")


@pytest.mark.nightly
def test_maps_are_pictures_with_or_without_questions(trained, tmp_path):
    with open(tmp_path / "terminal.txt", "w") as file:
        predict(PredictSettings(run=trained, maps=True), tmp_path / "out", Console(file=file, width=200))
    pictures = [p for p in (tmp_path / "out").iterdir() if p.suffix == ".png"]
    assert pictures
    assert all(p.read_bytes().startswith(SIGNATURE) for p in pictures)
    assert not (tmp_path / "out" / "answers.csv").exists()
    assert (tmp_path / "terminal.txt").read_text().count("map: ") == len(pictures)


def test_a_folder_that_cannot_be_written_is_told(trained, tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(UserError, match="Cannot write"):
        ask(trained, "sample,pressure_kpa,force_n,moment_nmm\n3,20,0,0\n", tmp_path / "out")
