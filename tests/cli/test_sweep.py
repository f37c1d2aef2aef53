"""Sweeps as a user runs them: gathered, resumed, killed, side by side, with any launcher."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import ROOT
from ended import Ended
from small_runs import make_csv

from freelearn.data.sets import overlap
from freelearn.records.sweep_records import collect
from freelearn.report.tables.sweep_tables import cells, summary


@pytest.fixture(scope="module")
def csv(tmp_path_factory) -> Path:
    return make_csv(tmp_path_factory.mktemp("data") / "table.csv", rows=400)


def words(csv: Path, folder: Path, fits: Path, *overrides: str) -> list[str]:
    fixed = ["figures=false", f"fits={fits}", f"hydra.sweep.dir={folder}", "data=csv", f"data.path={csv}"]
    return ["train", "-m", *fixed, *overrides]


@pytest.fixture(scope="module")
def sweep(csv, commands):
    """Runs a sweep into a folder."""

    def run(folder: Path, *overrides: str, fits: Path | None = None) -> Ended:
        return commands.run(*words(csv, folder, fits or folder.parent / "fits", *overrides))

    return run


def numbers(folder: Path) -> pd.DataFrame:
    table = pd.read_csv(folder / "heatmap.csv")
    return table[["model", "train", "test", "E", "E_force", "E_moment", "n", "seed"]]


def written(job: Path) -> int:
    return (job / "predictions.csv").stat().st_mtime_ns


@pytest.fixture(scope="module")
def finished(sweep, tmp_path_factory) -> Path:
    """A sweep of four good jobs and two that cannot work, run once for the tests that only read it."""
    folder = tmp_path_factory.mktemp("finished") / "sweep"
    result = sweep(folder, "model=linear,continuum", "train=sample3,all,sample9")
    assert result.status == 1, result.told
    assert "2 jobs failed" in result.err
    return folder


def test_a_sweep_gathers_every_job_and_keeps_the_errors_of_those_that_fail(finished):
    table = pd.read_csv(finished / "heatmap.csv", dtype={"run": str})
    failed = table[table["error"].notna()]
    assert set(failed["train"]) == {"sample9"}
    assert set(failed["model"]) == {"linear", "continuum"}
    assert failed["error"].str.contains("sample3, sample6").all()
    good = table[table["error"].isna()]
    assert set(good["test"]) == {"sample3", "sample6", "even", "all"}
    assert len(good) == 2 * 2 * 4
    for _, cell in good.iterrows():
        job = json.loads((finished / cell["run"] / "results.json").read_text())
        assert cell["E"] == pytest.approx(job["tests"][cell["test"]]["E"], rel=1e-7)
        assert (cell["model"], cell["train"]) == (job["model"], job["train"])
    for model in ("linear", "continuum"):
        assert (finished / f"heatmap_{model}.png").stat().st_size > 5000
        assert set(pd.read_csv(finished / f"heatmap_{model}.csv")["label"]) == {model}
    assert list((finished / "tensorboard").glob("events.out.tfevents.*"))


def test_a_sweep_goes_on_where_it_stopped(sweep, tmp_path):
    overrides = ("model=linear", "train=sample3,sample6,all")
    assert sweep(tmp_path / "sweep", *overrides).status == 0
    before = numbers(tmp_path / "sweep")
    jobs = [f"linear_{train}_seed0_{n}" for n, train in enumerate(("sample3", "sample6", "all"))]
    assert sorted(path.parent.name for path in (tmp_path / "sweep").glob("*/results.json")) == sorted(jobs)
    (tmp_path / "sweep" / jobs[1] / "results.json").unlink()
    # As earlier versions named it.
    (tmp_path / "sweep" / jobs[2]).rename(tmp_path / "sweep" / "2")
    times = {n: written(tmp_path / "sweep" / name) for n, name in enumerate((*jobs[:2], "2"))}
    result = sweep(tmp_path / "sweep", *overrides)
    assert result.status == 0, result.told
    assert result.out.count("done before") == 2
    later = {n: written(tmp_path / "sweep" / name) for n, name in enumerate(jobs)}
    assert [n for n in range(3) if later[n] != times[n]] == [1]
    pd.testing.assert_frame_equal(numbers(tmp_path / "sweep"), before)
    # Another seed is another job, whatever lies in the folder.
    assert "done before" not in sweep(tmp_path / "sweep", *overrides, "seed=5").out
    assert set(numbers(tmp_path / "sweep")["seed"]) == {5}


@pytest.mark.nightly
def test_a_killed_sweep_leaves_only_whole_results_and_resumes(csv, sweep, commands, tmp_path):
    jobs = 40
    overrides = ("model=linear", f"seed=range({jobs})", "train=all")
    folder = tmp_path / "sweep"
    process = commands.start(*words(csv, folder, tmp_path / "fits", *overrides))
    deadline = time.monotonic() + 120
    while len(list(folder.glob("*/results.json"))) < 3 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process, signal.SIGKILL)
    assert commands.wait(process).status == -signal.SIGKILL
    done = {path.parent.name: path.stat().st_mtime_ns for path in folder.glob("*/results.json")}
    assert 3 <= len(done) < jobs
    assert set(collect([folder])["run"]) == set(done)
    result = sweep(folder, *overrides, fits=tmp_path / "fits")
    assert result.status == 0, result.told
    assert result.out.count("done before") == len(done)
    assert all((folder / n / "results.json").stat().st_mtime_ns == t for n, t in done.items())
    assert sorted(collect([folder])["seed"].unique()) == list(range(jobs))


@pytest.mark.nightly
def test_two_sweeps_at_once_share_fits_and_do_not_disturb_each_other(csv, commands, tmp_path):
    overrides = ("model=linear,continuum", "train=sample3,sample6")
    pair = [commands.start(*words(csv, tmp_path / name, tmp_path / "fits", *overrides)) for name in ("a", "b")]
    assert [commands.wait(process).status for process in pair] == [0, 0]
    pd.testing.assert_frame_equal(numbers(tmp_path / "a"), numbers(tmp_path / "b"))
    assert len(list((tmp_path / "fits").glob("*.fit"))) == 4
    jobs = [json.loads(path.read_text()) for name in "ab" for path in (tmp_path / name).glob("*/results.json")]
    assert sum(not job["fit_reused"] for job in jobs) == 4


@pytest.mark.nightly
def test_single_pairings_fit_each_model_once_and_agree_with_the_whole_row(sweep, finished, tmp_path):
    result = sweep(tmp_path / "pairs", "model=linear", "train=sample3,all", "test=sample3,sample6,all")
    assert result.status == 0, result.told
    assert len(list((tmp_path / "fits").glob("*.fit"))) == 2
    pairs = numbers(tmp_path / "pairs").set_index(["train", "test"])["E"]
    whole = numbers(finished).query("model == 'linear'").set_index(["train", "test"])["E"]
    assert len(pairs) == 6
    np.testing.assert_array_equal(pairs, whole.reindex(pairs.index))


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("launcher", ["joblib", "submitit_local"])
def test_the_numbers_do_not_depend_on_the_launcher(launcher, csv, finished, tmp_path):
    # Each of their workers is a Python that imports everything; joblib's end with the process that asked for them.
    asked = words(csv, tmp_path / "sweep", tmp_path / "fits", "model=linear,continuum", "train=sample3,all")
    line = [sys.executable, "-m", "freelearn", *asked, f"hydra/launcher={launcher}"]
    result = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stderr
    expected = numbers(finished).query("train != 'sample9'").reset_index(drop=True)
    # The failed jobs beside the expected rows made their counts floats.
    pd.testing.assert_frame_equal(numbers(tmp_path / "sweep"), expected, check_dtype=False)


@pytest.mark.nightly
def test_gathering_several_sweeps_gives_means_and_deviations_over_seeds(sweep, commands, tmp_path):
    for seed in (1, 2):
        assert sweep(tmp_path / f"s{seed}", "model=linear", "train=sample3,all", f"seed={seed}").status == 0
    result = commands.run("gather", f"{tmp_path}/s1", f"{tmp_path}/s2", "--out", f"{tmp_path}/both")
    assert result.status == 0, result.told
    each = [numbers(tmp_path / f"s{seed}").set_index(["train", "test"])["E"] for seed in (1, 2)]
    both = pd.read_csv(tmp_path / "both" / "heatmap_linear.csv").set_index(["train", "test"])
    assert (both["seeds"] == 2).all()
    np.testing.assert_allclose(both["E"], ((each[0] + each[1]) / 2).reindex(both.index), rtol=1e-6)
    spread = (each[0] - each[1]).abs().reindex(both.index) / np.sqrt(2)
    np.testing.assert_allclose(both["deviation"], spread, rtol=1e-4, atol=1e-9)
    assert set(pd.read_csv(tmp_path / "both" / "heatmap.csv")["run"]) == {
        f"s{seed}/linear_{train}_seed{seed}_{n}" for seed in (1, 2) for n, train in enumerate(("sample3", "all"))
    }


def test_a_folder_without_results_is_one_clear_error(commands, tmp_path):
    result = commands.run("gather", str(tmp_path))
    assert result.status == 1
    assert result.err.startswith("error: No results in ")
    assert "Traceback" not in result.err


def table_of(errors: dict[tuple[str, str, str], float], **more) -> pd.DataFrame:
    rows = [{"label": m, "train": a, "test": b, "E": e} for (m, a, b), e in errors.items()]
    return pd.DataFrame(rows).assign(**{"error": "", "seed": 0, "parameters": 3, "n": 100, **more})


def test_summary_by_hand():
    errors = {
        ("a", "sample1", "sample1"): 0.1,
        ("a", "sample1", "sample2"): 0.5,
        ("a", "sample2", "sample1"): 0.3,
        ("a", "sample2", "sample2"): 0.2,
        ("a", "constituent", "sample1"): 0.9,
        ("b", "sample1", "sample1"): 0.05,
        ("b", "sample1", "sample2"): 0.8,
        ("b", "sample2", "sample1"): 0.6,
        ("b", "sample2", "sample2"): 0.4,
    }
    a, b = (row for _, row in summary(table_of(errors)).iterrows())
    assert a["mean"] == pytest.approx(1.1 / 4)
    assert a["range"] == pytest.approx(0.4)
    assert a["diagonal"] == pytest.approx(0.15)
    assert a["unseen"] == pytest.approx(0.4)
    assert a["constituent"] == pytest.approx(0.9)
    assert (a["best_share"], b["best_share"]) == (0.75, 0.25)
    assert cells(table_of(errors))["best"].sum() == 5


@pytest.mark.parametrize(
    ("first", "second", "shared"),
    [
        ("sample1", "sample1", True),
        ("sample1", "sample2", False),
        ("sample1", "even", False),
        ("even", "sample4", True),
        ("all", "sample7", True),
        ("without3", "sample3", False),
        ("without3", "sample4", True),
        ("sample12", "all", True),
    ],
)
def test_which_sets_share_samples(first, second, shared):
    assert overlap(first, second) is shared
    assert overlap(second, first) is shared
