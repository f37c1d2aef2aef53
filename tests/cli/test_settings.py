"""Settings: every mistake is told, in words, before anything heavy is loaded."""

import os
import subprocess
import sys
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import pytest
from conftest import ROOT
from nightly import usually

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import CsvData, DiscoverSettings, TrainSettings
from freelearn.api.tasks.loaded_table import job_key
from freelearn.common.errors import UserError
from freelearn.data.beds import DEAD_LOAD, ISOMETRIC, KINEMATIC
from freelearn.workbench.state.question import Question
from freelearn.workbench.state.reading import discover_settings, train_settings

MISTAKES = {
    "seed=abc": "seed = 'abc' is not an integer",
    "seed=1.5": "seed = 1.5 is not an integer",
    "seed=true": "seed = True is not an integer",
    "model.C1=soft": "model.C1 = 'soft' is not a number",
    "model.C1=nan": "model.C1 = nan is not a finite number",
    "train=3": "train = 3: give a set's name",
    "effects=end_clamps": "effects = 'end_clamps': give a list",
    "data.seed=-1": "data.seed = -1 is too small: choose at least 0",
    "data.hidden=foo": "data.hidden = 'foo': give a list of effect names",
    "data.accuracy=guess": "data.accuracy = 'guess': give data.accuracy.force_n",
    "data.accuracy=estimate": "estimate is for measured data",
    "data.accuracy.force_n=0": "data.accuracy.force_n = 0 is too small: choose more than 0",
    "data.accuracy.twist_deg=-1": "data.accuracy.twist_deg = -1 is too small",
    "data.accuracy.moment_nmm=big": "data.accuracy.moment_nmm = 'big' is not a number",
    "fit.max_epochs=0": "fit.max_epochs = 0 is too small: choose at least 1",
    "+fit.foo=1": "fit.foo is no option here",
    "+split.tain=1": "split.tain is no option here",
    "split.train=0.9": "leave nothing to test on",
    "figures=3": "figures = 3 is neither true nor false",
    "device=tpu": "device = 'tpu' is not possible",
    "data=csv": "data=csv needs the table's file: add data.path=FILE",
}


@pytest.mark.parametrize("kind", usually(TrainSettings, nightly=[DiscoverSettings]))
@pytest.mark.parametrize("override", MISTAKES)
def test_a_mistake_is_told_in_words(kind, override):
    with pytest.raises(UserError) as told:
        settings(kind, [override])
    assert MISTAKES[override] in str(told.value)


def test_all_mistakes_are_told_together():
    with pytest.raises(UserError) as told:
        settings(TrainSettings, ["seed=abc", "model.C1=soft", "fit.max_epochs=0"])
    lines = str(told.value).splitlines()
    assert lines[0] == "3 mistakes:"
    assert {line.split(" = ")[0].strip() for line in lines[1:]} == {"seed", "model.C1", "fit.max_epochs"}


def test_settings_are_frozen_and_in_si():
    chosen = settings(TrainSettings, ["train=[sample1,sample3]", "fit=none", "effects=[end_clamps]"])
    with pytest.raises(FrozenInstanceError):
        chosen.seed = 3
    assert (chosen.train, chosen.fit, chosen.effects) == ("sample1+sample3", None, ("end_clamps",))
    assert chosen.data.accuracy.si().pressure == pytest.approx(150.0)


@pytest.mark.parametrize("column", ["elongation_mm", "twist_deg"])
def test_what_is_imposed_may_be_exact_and_what_is_measured_not(column):
    """Where loads hang, places are measured."""
    exact = settings(TrainSettings, [f"data.accuracy.{column}=0"]).data.accuracy
    assert {exact.si(KINEMATIC).length, exact.si(ISOMETRIC).twist} & {0.0}
    with pytest.raises(UserError, match=f"accuracy.{column} = 0: a bed of the kind dead_load measures this"):
        exact.si(DEAD_LOAD)


@pytest.mark.parametrize(
    "question",
    [
        Question(),
        Question(data="hidden", seed=7, model="linear", train="all", effects=("twist_offset",)),
        Question(data="csv", path="{csv}", name="mine.csv", model="mlp", train="sample3"),
    ],
)
def test_the_page_asks_for_what_its_command_line_says(question, tmp_path):
    (tmp_path / "it's mine, [really].csv").write_text("sample\n")
    question = replace(question, path=question.path.format(csv=tmp_path / "it's mine, [really].csv"))
    assert discover_settings(question) == settings(DiscoverSettings, question.overrides("discover"))
    typed = settings(TrainSettings, question.overrides("train"))
    assert train_settings(question, typed.fits) == typed


def test_the_key_changes_with_everything_that_results_depend_on(tmp_path, monkeypatch):
    table, own, specimen = (tmp_path / name for name in ("table.csv", "own.py", "specimen.json"))
    for path in (table, own, specimen):
        path.write_text("1")
    chosen = settings(TrainSettings, ["data=csv", f"data.path={table}", f"constituent={specimen}"])
    assert isinstance(chosen.data, CsvData)
    keys = [job_key(chosen)]
    assert job_key(chosen) == keys[0]
    keys.append(job_key(replace(chosen, seed=1)))
    for path in (table, specimen):
        path.write_text("2")
        keys.append(job_key(chosen))
    monkeypatch.setenv("FREELEARN_EFFECTS", str(own))
    keys.append(job_key(chosen))
    own.write_text("2")
    keys.append(job_key(chosen))
    monkeypatch.setattr("freelearn.api.tasks.loaded_table.code_version", lambda rooms: "another code")
    keys.append(job_key(chosen))
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("script", ["train.py", "discover.py"])
def test_a_mistyped_path_is_told_at_once_and_leaves_nothing(script, tmp_path):
    folder = tmp_path / "day" / "run"
    line = [sys.executable, "-X", "importtime", script, "data=csv", "data.path=nowhere.csv", f"hydra.run.dir={folder}"]
    done = subprocess.run(line, cwd=ROOT, env=os.environ, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode != 0
    assert "error: There is no file nowhere.csv" in done.stderr
    # Quick, because nothing that computes was imported.
    imported = {row.rsplit("|", 1)[-1].strip() for row in done.stderr.splitlines() if row.startswith("import time:")}
    assert imported.isdisjoint({"torch", "lightning", "sklearn", "matplotlib", "bokeh"})
    assert not list(Path(tmp_path).iterdir())
