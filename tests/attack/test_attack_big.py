"""A table of ten million rows through `train`: little memory, whole results. Only with FREELEARN_TESTS=all."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from conftest import ROOT
from nightly import EVERY

from freelearn.common.csv_text import csv_blocks
from freelearn.data.beds import NMM
from freelearn.data.states import States
from freelearn.physics.models.continuum import Continuum
from freelearn.physics.simulated_bed import DESIGNS

ROWS, PIECE = 10_000_000, 100_000
# Of the whole command, the libraries included [GiB].
MOST = 4.0
# Runs a command and says what it used at most [KiB].
MEASURED = (
    "import resource, subprocess, sys; status = subprocess.call(sys.argv[1:]);"
    "print('used', resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss); sys.exit(status)"
)


def make_big(path: Path, rows: int) -> Path:
    """Two samples, ten pressures at each state, loads of a continuum model plus the paper's noise, piece by piece."""
    generator, names = np.random.default_rng(0), ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
    pressures = np.array([0, 10, 20, 30, 40, 50, 60, 70, 35, 1.0])
    with open(path, "w") as file:
        for start in range(0, rows, PIECE):
            count = min(PIECE, rows - start) // 10
            sample = generator.choice([3, 6], count)
            table = pd.DataFrame({"sample": np.repeat(sample, 10)})
            for name, values in zip(names, np.array(DESIGNS)[sample - 1].T, strict=True):
                table[name] = np.repeat(values, 10)
            table["step"] = np.tile(np.arange(10), count)
            table["elongation_mm"] = np.repeat(generator.uniform(-4, 4, count).round(5), 10)
            table["twist_deg"] = np.repeat(generator.uniform(-90, 90, count).round(4), 10)
            table["pressure_kpa"] = (pressures[table["step"]] + generator.normal(0, 0.05, len(table))).round(3)
            with torch.no_grad():
                loads = Continuum(1e6, 2e7)(States.from_table(table)).loads.numpy()
            table["force_n"] = loads[:, 0] + generator.normal(0, 0.03, len(table))
            table["moment_nmm"] = loads[:, 1] / NMM + generator.normal(0, 0.6, len(table))
            blocks = csv_blocks(table.assign(buckled=0), "%.6g")
            head = next(blocks)
            file.write(head if start == 0 else "")
            file.writelines(blocks)
    return path


@pytest.mark.slow
@pytest.mark.skipif(not EVERY, reason="ten minutes and gigabytes: make attack")
def test_ten_million_rows_go_through_train(tmp_path):
    csv, folder = make_big(tmp_path / "big.csv", ROWS), tmp_path / "run"
    words = ["train=all", "data=csv", f"data.path={csv}", "fits=null", f"hydra.run.dir={folder}"]
    line = [sys.executable, "-c", MEASURED, sys.executable, "train.py", *words]
    ended = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, timeout=3600, check=False)
    assert ended.returncode == 0, ended.stderr
    used = int(ended.stdout.split()[-1]) / 2**20
    results = json.loads((folder / "results.json").read_text())
    assert results["counts"]["rows"] == ROWS
    for name, truth in (("C1", 1e6), ("C2", 2e7)):
        assert results["parameters"][name]["value"] == pytest.approx(truth, rel=1e-3)
    with open(folder / "predictions.csv") as file:
        assert sum(1 for _ in file) == ROWS + 1
    csv.unlink()
    assert used < MOST, f"{used:.2f} GiB"
