"""Commands into impossible places, under limits, and two at once: one sentence and exit status 1, or whole results."""

import json
import os
import signal
import time
from pathlib import Path

import pytest
from attack_place import make_place, of
from ended import Ended
from nightly import chosen, usually


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    return make_place(tmp_path_factory.mktemp("places"))


def unfinished(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if ".part" in path.name or path.name.startswith(".writable")]


def refused(ended: Ended, *words: str) -> None:
    assert ended.status == 1, ended.told
    assert "Traceback" not in ended.told
    assert ended.err.startswith("error: "), ended.err
    assert all(word in ended.err for word in words), ended.err
    assert len(ended.err.strip().splitlines()) == 1, ended.err


LONG = "n" * 300
PLACES = {
    "file": "{0}/file",
    "below": "{0}/file/run",
    "long": "{0}/" + LONG,
    "proc": "/proc/none",
    "bytes": "{0}/\udcff",
}
INTO = {
    "train": ("train", "{data}", "fits=null", "hydra.run.dir={out}"),
    "sweep": ("train", "-m", "{data}", "fits=null", "hydra.sweep.dir={out}"),
    "discover": ("discover", "{data}", "hydra.run.dir={out}"),
    "plan": ("plan", "run={place}/fitted", "rows=2", "hydra.run.dir={out}"),
    "predict": ("predict", "run={place}/fitted", "maps=true", "hydra.run.dir={out}"),
    "intake": ("intake", "data.path={place}/raw.csv", "hydra.run.dir={out}"),
    "gather": ("gather", "{place}/sweep", "--out", "{out}"),
    "figures": ("figures", "{place}/sweep", "--out", "{out}"),
}


def line(command: str, place: Path, out: str) -> list[str]:
    data = of(place)
    words = [data if word == "{data}" else [word.format(place=place, out=out)] for word in INTO[command]]
    return [word for several in words for word in several]


EVERYWHERE = [(c, p) for c in INTO for p in PLACES if (c, p) not in (("gather", "bytes"), ("figures", "bytes"))]


@pytest.mark.slow
@pytest.mark.parametrize(("command", "name"), chosen(EVERYWHERE, 6, seed=17))
def test_a_command_into_an_impossible_place_is_one_sentence(command, name, place, commands):
    before = sorted(os.listdir(place))
    ended = commands.run(*line(command, place, PLACES[name].format(place)))
    refused(ended)
    assert sorted(os.listdir(place)) == before
    assert (place / "file").read_text() == "kept as it is"


LIMITS = [(command, largest) for largest in (0, 100, 1000, 4000, 15000) for command in INTO]


@pytest.mark.slow
@pytest.mark.parametrize(("command", "largest"), chosen(LIMITS, 6, seed=3))
def test_a_limit_on_the_size_of_files_is_one_sentence(command, largest, place, commands, tmp_path):
    out = tmp_path / "out"
    ended = commands.run(*line(command, place, str(out)), largest=largest)
    assert "Traceback" not in ended.told
    if ended.status:
        assert ended.status == 1
        assert ended.err.startswith("error: ")
        assert "File too large" in ended.told or (command == "sweep" and "jobs failed" in ended.err), ended.told
    assert not unfinished(tmp_path)
    for mark in ("results.json", "discovery.json", "plan.json"):
        for path in out.rglob(mark):
            json.loads(path.read_text())
    assert not list(out.rglob("traceback.txt")), "a full disk is no bug"


@pytest.mark.slow
def test_fits_that_cannot_be_kept_do_not_fail_the_command_and_are_told(place, commands, tmp_path):
    words = [*of(place), "model=linear", "figures=false", f"fits={place / 'file/below'}"]
    ended = commands.run("train", *words, f"hydra.run.dir={tmp_path / 'run'}")
    assert ended.status == 0, ended.told
    assert "could not be kept for other runs" in " ".join(ended.out.split())
    assert (tmp_path / "run/results.json").exists()


@pytest.mark.slow
def test_a_terminal_that_takes_no_more_loses_no_results(place, commands, tmp_path):
    words = [*of(place), "train=constituent", "figures=false", f"hydra.run.dir={tmp_path / 'run'}"]
    ended = commands.run("train", *words, out="/dev/full")
    assert "Traceback" not in ended.err
    assert ended.status != 0
    assert json.loads((tmp_path / "run/results.json").read_text())["train"] == "constituent"


# --- two at once ------------------------------------------------------------------------------------------------------


def wait_for(path: Path, seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not path.exists():
        assert time.monotonic() < end, f"no {path}"
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.parametrize("several", usually(False, nightly=[True]), ids=["run", "sweep"])
def test_of_two_commands_in_one_folder_the_second_is_told_and_changes_nothing(several, place, commands, tmp_path):
    out = tmp_path / "out"
    option = f"hydra.{'sweep' if several else 'run'}.dir"
    words = ["train", *(["-m"] if several else []), *of(place), "fits=null", f"{option}={out}"]
    endless = [*words, "model=mlp", "fit=adam", "fit.max_epochs=1000000", "figures=false"]
    first = commands.start(*endless)
    wait_for(out / ("multirun.yaml" if several else ".hydra/overrides.yaml"))
    os.kill(first, signal.SIGSTOP)
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*")}
    refused(commands.run(*words), "is being written by another command", option)
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*")} == before
    # What holds the folder goes with the process, however it ends.
    os.kill(first, signal.SIGKILL)
    assert commands.wait(first).status == -signal.SIGKILL
    again = commands.run(*words, "train=constituent", "figures=false")
    assert again.status == 0, again.told
    assert not [path for path in out.rglob("*") if "lock" in path.name]
