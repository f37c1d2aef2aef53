"""The same numbers, to the last bit: another process and hash seed, a fit kept or made anew; and how far they move
where more threads or another order of the rows make them another sum."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from attack_kills import contents, differing, without_times
from conftest import ROOT
from hidden_tables import table
from nightly import EVERY
from rich.console import Console
from small_runs import make_csv

from freelearn.api.settings.configuration import settings
from freelearn.api.settings.settings import DiscoverSettings, TrainSettings
from freelearn.api.tasks.discover_task import discover
from freelearn.api.tasks.train_task import train
from freelearn.fitting.starts import best_stiffness

FRICTION = {"friction_hysteresis": {"force": 0.6, "moment": 0.02}}
# Commands in one process, one after another, each into a folder of its own.
CHILD = """
import json, sys
from pathlib import Path
from attack_runs import command
for name, words in json.loads(sys.argv[2]).items():
    ended = command(*words, f"hydra.run.dir={sys.argv[1]}/{name}", folder=Path(sys.argv[1]))
    assert ended.status == 0, ended.said
"""


@pytest.mark.slow
@pytest.mark.nightly
def test_another_process_and_hash_seed_give_the_same_bits(tmp_path):
    make_csv(tmp_path / "table.csv", rows=1200)
    table(FRICTION, samples=(3,), share=0.05).to_csv(tmp_path / "hidden.csv", index=False)
    fit = ["train", "data=csv", f"data.path={tmp_path}/table.csv", "train=all", "fits=null", "figures=false"]
    commands = {
        "linear": [*fit, "model=linear"],
        "continuum": [*fit, "effects=[force_offset,length_compliance]"],
        "network": [*fit, "model=mlp", "fit.max_epochs=20"],
        "search": ["discover", "data=csv", f"data.path={tmp_path}/hidden.csv", "figures=false"],
    }
    found = []
    # What else is in a process's environment moves what it keeps in memory.
    for hash_seed, more in [("1", ""), ("2", "x" * 4321), ("3", "x" * 77)][: 3 if EVERY else 2]:
        out = tmp_path / "out"
        out.mkdir()
        paths = os.pathsep.join([str(ROOT), str(ROOT / "tests" / "support")])
        env = os.environ | {"PYTHONHASHSEED": hash_seed, "PYTHONPATH": paths, "MORE": more}
        # One thread, which is what a command takes where nothing is said.
        env.pop("OMP_NUM_THREADS", None)
        line = [sys.executable, "-W", "ignore", "-c", CHILD, str(out), json.dumps(commands)]
        done = subprocess.run(line, env=env, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode == 0, done.stderr
        found.append(contents(out))
        shutil.rmtree(out)
    assert len(found[0]) > 20
    for other in found[1:]:
        assert differing(found[0], other) == []


@pytest.mark.slow
def test_another_number_of_threads_moves_the_last_digits_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    asked = settings(TrainSettings, ["model=linear", "train=all", "fits=null", "figures=false"])
    found = []
    for threads in (1, 2):
        torch.set_num_threads(threads)
        try:
            found.append(train(asked, tmp_path / str(threads)).model.scalars())
        finally:
            torch.set_num_threads(1)
    one, two = found
    assert one.keys() == two.keys()
    assert all(abs(one[name] / two[name] - 1) < 1e-12 for name in one)


def test_a_fit_kept_is_the_fit_made_anew(tmp_path):
    path = make_csv(tmp_path / "table.csv", rows=160)

    def numbers(fits):
        words = [f"fits={fits}", "data=csv", f"data.path={path}", "train=all", "model=linear", "figures=false"]
        train(settings(TrainSettings, words), tmp_path / "run")
        document = json.loads((tmp_path / "run" / "results.json").read_text())
        told = contents(tmp_path / "run")
        return document["fit_reused"], told["predictions.csv"], told["checkpoint.ckpt"], without_times(document)

    made, anew, kept = numbers(tmp_path / "fits"), numbers("null"), numbers(tmp_path / "fits")
    assert (made[0], anew[0], kept[0]) == (False, False, True)
    assert made[1:] == anew[1:] == kept[1:]


def test_what_memory_held_before_does_not_count():
    """torch's least squares, by default, exchange columns by numbers that nobody has written."""
    generator = torch.Generator().manual_seed(0)
    columns = torch.randn(40, 3, dtype=torch.float64, generator=generator)
    target = columns @ torch.tensor([2.0, 3.0, 0.5], dtype=torch.float64)
    target += 0.1 * torch.randn(40, dtype=torch.float64, generator=generator)
    found = set()
    for k in range(600):
        # Freed at once, for the next to find.
        held = [torch.full((size,), k % 5 - 2, dtype=torch.int32) for size in (2, 3, 3, 4, 4, 8)]
        del held
        found.add(best_stiffness(columns, target))
    assert len(found) == 1


def searched(measured: pd.DataFrame, folder: Path) -> dict:
    folder.mkdir()
    measured.to_csv(folder / "table.csv", index=False)
    asked = settings(DiscoverSettings, ["data=csv", f"data.path={folder / 'table.csv'}", "figures=false"])
    with open(os.devnull, "w") as nowhere:
        discover(asked, folder, Console(file=nowhere))
    return json.loads((folder / "discovery.json").read_text())


def moved(one: dict, other: dict) -> float:
    """By how many standard errors a parameter of the last model differs at most."""
    (a, errors), b = (one["trail"][-1][name] for name in ("parameters", "stderr")), other["trail"][-1]["parameters"]
    assert a.keys() == b.keys()
    return max(abs(a[name] - b[name]) / errors[name] for name in a)


@pytest.mark.slow
@pytest.mark.nightly
def test_the_order_of_columns_samples_and_states_moves_numbers_as_the_documentation_says(tmp_path):
    measured = table(FRICTION, samples=(3, 6), share=0.05).drop(columns="time_s")
    first = searched(measured, tmp_path / "first")
    assert first["effects"] == ["friction_hysteresis"]
    columns = searched(measured[measured.columns[::-1]], tmp_path / "columns")
    # The tables that it writes have their columns in the order of the one it read.
    assert {name for name in first if first[name] != columns[name]} == {"data", "key", "files", "digest"}
    exchanged = pd.concat([measured[measured["sample"] == n] for n in (6, 3)], ignore_index=True)
    samples = searched(exchanged, tmp_path / "samples")
    assert samples["effects"] == first["effects"]
    assert moved(first, samples) < 1e-9
    block = (measured["step"] == 0).cumsum().to_numpy()
    order = np.random.default_rng(1).permutation(np.unique(block))
    shuffled = pd.concat([measured[block == k] for k in order], ignore_index=True).sort_values("sample", kind="stable")
    states = searched(shuffled, tmp_path / "states")
    assert states["effects"] == first["effects"]
    assert moved(first, states) < 0.02
