"""The lines of Python that the page shows ask for what its command asks for."""

import shlex
import sys
from dataclasses import replace
from pathlib import Path

import beds
import pytest

import freelearn.api.tasks.discover_task
import freelearn.api.tasks.train_task
from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings, TrainSettings
from freelearn.workbench.panels.python_lines import python_lines
from freelearn.workbench.state.question import Question

KINDS = {"train": TrainSettings, "discover": DiscoverSettings}
QUESTIONS = {
    "first": Question(),
    "hidden": Question("hidden", 4, effects=("end_clamps",), fit_seed=3),
    "muscle": Question("dmsp20", train="all", bed="isometric", ruled_out=("force_gain",), split="rows"),
    "network": Question(model="mlp", fit="adam", per_sample=False),
    "own": Question("csv", train="all", bed="isometric", accuracy=None),
    "accurate": Question("csv", train="all", bed="isometric", accuracy=(("force_n", 0.5),), split="rows"),
}


class Asked(Exception):
    """The settings that a function was about to use."""


@pytest.fixture
def asked(monkeypatch):
    """The settings that lines of Python come to."""

    def told(chosen, *_, **__):
        raise Asked(chosen)

    monkeypatch.setattr(freelearn.api.tasks.train_task, "train", told)
    monkeypatch.setattr(freelearn.api.tasks.discover_task, "discover", told)

    def of(lines):
        with pytest.raises(Asked) as found:
            exec("\n".join(lines), {})
        return found.value.args[0]

    return of


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", QUESTIONS)
def test_the_lines_ask_what_the_command_asks(kind, name, asked, tmp_path):
    question = QUESTIONS[name]
    if question.data == "csv":
        path = tmp_path / "mine.csv"
        beds.TABLES["isometric"]({}).to_csv(path, index=False)
        question = replace(question, path=str(path))
    command = settings(KINDS[kind], question.overrides(kind))
    lines = asked(python_lines(question, kind))
    # Where files are kept and which pictures are written is no part of the question.
    same = {"fits": None, "figures": False, "bands": True}
    own = {name: value for name, value in same.items() if hasattr(command, name)}
    assert replace(lines, **own) == replace(command, **own)


def test_the_lines_of_a_study_ask_for_each_of_its_fits(asked):
    question = Question(models=("linear", "continuum"), trains=("sample3", "even"))
    assert asked(python_lines(question, "study")).train == "sample3"


def test_the_command_runs_where_the_page_was_started(tmp_path, monkeypatch):
    asked = Question("csv", path="my table.csv", train="all", accuracy=None)
    assert asked.command("train").startswith("python train.py model=continuum train=all data=csv ")
    assert asked.command("intake").startswith("python intake.py ")
    # In any other folder there is no train.py.
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [".venv/bin/freelearn workbench"])
    monkeypatch.setenv("PATH", str(tmp_path))
    assert asked.command("train").startswith(".venv/bin/freelearn train model=continuum train=all data=csv ")
    monkeypatch.setattr(sys, "argv", ["/somewhere/freelearn/workbench/__main__.py"])
    words = shlex.split(asked.command("discover"))
    assert words[1:4] == ["-m", "freelearn", "discover"]
    assert Path(words[0]).resolve() == Path(sys.executable).resolve()
