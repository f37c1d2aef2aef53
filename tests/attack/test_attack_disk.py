"""Writing where the system refuses, into folders that are deleted meanwhile, by clocks that jump: never half a file."""

import errno
import json
import os
import shutil
import time
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from attack_place import make_place, of
from fitted_folders import continuum, grid
from rich.console import Console
from small_runs import run

from freelearn.api.settings.configuration import composed
from freelearn.api.settings.parse import parsed
from freelearn.api.settings.run_settings import PredictSettings
from freelearn.api.settings.settings import IntakeSettings
from freelearn.cli.gathering import gather_folders
from freelearn.cli.hold import hold
from freelearn.cli.intake_command import take_in
from freelearn.cli.run_commands import predict
from freelearn.common.errors import UserError
from freelearn.common.files import write_text
from freelearn.fitting.store import FitStore
from freelearn.records.run_files import check_folder

FULL = r"Cannot write to .*: No space left on device"
REFUSALS = (errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EFBIG, errno.EIO, errno.EDQUOT)


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    return make_place(tmp_path_factory.mktemp("disk"), covariance=np.diag([1e6, 1e9]))


def unfinished(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if ".part" in path.name or path.name.startswith(".writable")]


# --- one file --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", REFUSALS)
@pytest.mark.parametrize("step", ["open", "replace"])
def test_a_file_that_cannot_be_written_stays_as_it_was(number, step, tmp_path, monkeypatch):
    path = tmp_path / "results.json"
    write_text(path, "before")

    def refuse(*_, **__):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(*((Path, "write_bytes") if step == "open" else (os, "replace")), refuse)
    with pytest.raises(UserError, match=f"^Cannot write to {path}: {os.strerror(number)}. What to do: "):
        write_text(path, "after")
    monkeypatch.undo()
    assert path.read_text() == "before"
    assert os.listdir(tmp_path) == ["results.json"]


@pytest.mark.parametrize("make", [check_folder, lambda folder: hold(folder, "hydra.run.dir")])
@pytest.mark.parametrize("name", ["file", "file/below", "n" * 300, "n/" * 3000, "a\0b", "/proc/no_such_place"])
def test_an_impossible_folder_is_a_sentence(make, name, tmp_path):
    (tmp_path / "file").write_text("kept as it is")
    with pytest.raises(UserError, match=r"^Cannot write to ") as told:
        make(tmp_path / name)
    assert str(told.value).isprintable()
    assert len(str(told.value)) < 600
    assert (tmp_path / "file").read_text() == "kept as it is"
    assert os.listdir(tmp_path) in (["file"], sorted(["file", "n"]), sorted(["n", "file"], reverse=True))


@pytest.mark.parametrize("number", REFUSALS)
def test_a_fit_that_cannot_be_kept_is_still_told(number, place, tmp_path, monkeypatch):
    plain = run(tmp_path / "plain", *of(place), "model=linear", "figures=false")
    write = os.replace

    def replace(source, target):
        if str(target).endswith(".fit"):
            raise OSError(number, os.strerror(number))
        write(source, target)

    monkeypatch.setattr(os, "replace", replace)
    outcome = run(tmp_path / "run", *of(place), "model=linear", "figures=false", f"fits={tmp_path / 'fits'}")
    assert outcome.model.scalars() == plain.model.scalars()
    (note,) = [n for n in json.loads((tmp_path / "run/results.json").read_text())["notes"] if "kept" in n]
    assert note.startswith("the fit could not be kept for other runs: Cannot write to ")
    assert os.strerror(number) in note
    assert not unfinished(tmp_path)


def test_a_folder_of_fits_that_cannot_be_made_is_a_note(place, tmp_path):
    for fits in (place / "file", place / "file/below", Path("/proc/none"), tmp_path / ("n" * 300)):
        store = FitStore(fits)
        model = continuum()
        fit = store.fitted(model, "0" * 24, lambda: "computed")
        assert fit == "computed"
        assert store.unkept.startswith(f"Cannot write to {str(fits)[:100]}")
        assert "fits=" in store.unkept or "shorter name" in store.unkept
    assert (place / "file").read_text() == "kept as it is"


# --- each file of each command refused in turn -----------------------------------------------------------------------


def _train(place: Path, out: Path) -> None:
    run(out, *of(place), "train=constituent", "figures=false")


def _gather(place: Path, out: Path) -> None:
    gather_folders([place / "sweep"], out, quiet(), "again")


def _predict(place: Path, out: Path) -> None:
    questions = grid().head(2).assign(force_n=float("nan"), moment_nmm=float("nan"))
    questions.to_csv(place / "questions.csv", index=False)
    words = [f"run={place / 'fitted'}", f"data.path={place / 'questions.csv'}", "bands=false"]
    predict(parsed(PredictSettings, composed("predict", words)), out, quiet())


def _intake(place: Path, out: Path) -> None:
    take_in(parsed(IntakeSettings, composed("intake", [f"data.path={place / 'raw.csv'}"])), out, quiet())


def quiet() -> Console:
    return Console(file=StringIO())


WRITERS = {
    _train: "results.json",
    _gather: "heatmap.csv",
    _predict: "answers.csv",
    _intake: "raw_recipe.yaml",
}


@contextmanager
def full_after(folder: Path, count: int):
    """A disk that takes so many more files in the folder; gives the names of those that it took."""
    move, taken = os.replace, []

    def replace(source, target):
        if folder in Path(target).parents:
            if len(taken) == count:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            taken.append(Path(target).name)
        move(source, target)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, "replace", replace)
        yield taken


@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
def test_a_disk_that_fills_at_any_file_leaves_whole_files_and_no_mark(write, place, tmp_path):
    whole, mark = tmp_path / "whole", WRITERS[write]
    with full_after(whole, 1000) as names:
        write(place, whole)
    assert mark in names
    for count in range(len(names)):
        out = tmp_path / str(count)
        with (
            full_after(out, count) as taken,
            pytest.raises(UserError, match=FULL),
        ):
            write(place, out)
        assert taken == names[:count]
        assert not unfinished(out)
        for name in taken:
            if name.endswith(".csv"):
                pd.testing.assert_frame_equal(pd.read_csv(out / name), pd.read_csv(whole / name))


def test_an_older_whole_run_is_not_taken_for_the_one_that_failed(place, tmp_path):
    out = tmp_path / "run"
    run(out, *of(place), "train=constituent", "figures=false")
    before = json.loads((out / "results.json").read_text())
    with full_after(out, 2) as taken, pytest.raises(UserError):
        run(out, *of(place), "train=constituent", "figures=false", "seed=1")
    assert taken == ["report.html", "predictions.csv"]
    assert not (out / "results.json").exists(), "new predictions beside old results"
    run(out, *of(place), "train=constituent", "figures=false")
    after = json.loads((out / "results.json").read_text())
    assert after["tests"] == before["tests"]


# --- a folder that is deleted, a clock that jumps -------------------------------------------------------------------


def test_results_are_written_anew_where_the_folder_was_deleted_while_computing(place, tmp_path, monkeypatch):
    import freelearn.api.tasks.train_task as command

    out, judged = tmp_path / "run", command._judged

    def deleted(*given):
        shutil.rmtree(out)
        return judged(*given)

    monkeypatch.setattr(command, "_judged", deleted)
    run(out, *of(place), "train=constituent", "figures=false")
    content = json.loads((out / "results.json").read_text())
    assert set(content["tests"]) == {"sample3", "sample6", "even", "all"}
    assert {"predictions.csv", "checkpoint.ckpt", "fit_report.txt", "report.html"} <= set(os.listdir(out))


def test_a_folder_deleted_while_it_is_written_is_a_sentence_and_no_whole_run(place, tmp_path, monkeypatch):
    import freelearn.records.run_files as files

    out, save = tmp_path / "run", files.save_checkpoint

    def deleted(*given):
        shutil.rmtree(out)
        save(*given)

    monkeypatch.setattr(files, "save_checkpoint", deleted)
    with pytest.raises(UserError, match=r"Cannot write to .*checkpoint.ckpt: No such file or directory"):
        run(out, *of(place), "train=constituent", "figures=false")
    assert not out.exists()


@pytest.mark.slow
def test_a_clock_that_jumps_changes_nothing(place, tmp_path, monkeypatch):
    words = [*of(place), "model=linear", f"fits={tmp_path / 'fits'}", "figures=false"]
    plain = run(tmp_path / "plain", *words, "fits=null")
    jumps = iter(range(10**6))

    def now() -> float:
        # Back by a day, forward by a year, again and again.
        return 1.6e9 + (-86400.0 if next(jumps) % 2 else 3.15e7)

    monkeypatch.setattr(time, "time", now)
    monkeypatch.setattr(time, "time_ns", lambda: int(now() * 1e9))
    outcomes = [run(tmp_path / str(n), *words) for n in range(2)]
    monkeypatch.undo()
    assert [outcome.reused for outcome in outcomes] == [False, True]
    for n, outcome in enumerate(outcomes):
        assert outcome.errors == plain.errors
        assert torch.equal(outcome.model.vector(), plain.model.vector())
        content = json.loads((tmp_path / str(n) / "results.json").read_text())
        assert 0 < content["seconds"] < 600
        assert 0 < content["fit_seconds"] < 600
