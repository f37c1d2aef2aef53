"""What the referee costs beside the search that asks it, and searches of simulated tables beside one search."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
from benchmark.common import ACCURACY, ROOT, Report, rows_of, table

import freelearn as fl
from freelearn.data.accuracy import Accuracy
from freelearn.discovery.search import search as searching
from freelearn.discovery.search.testable import question_of_rows
from freelearn.physics.chain.model import Model
from freelearn.physics.models.build import build_model

# Simulated tables; rows of a table that tells much, and of one that tells little.
TABLES, MANY, FEW = 40, 2000, 85


def referee(report: Report) -> None:
    """Many rows and few of one actuator; and a table of one row."""
    whole = table({"friction_hysteresis": {"force": 0.5, "moment": 0.01}})
    one = whole[whole["sample"] == 3]
    took, asked = _searched(one[:MANY])
    report(f"the referee on {MANY} rows", f"{asked:.2f} s", "≤ 2 s", f"{asked / took:.0%} of the search, {took:.1f} s")
    # Some whole states, all over the protocol.
    state = (one[["elongation_mm", "twist_deg"]].diff().abs().sum(axis=1) > 0).cumsum()
    each = len(one) // state.nunique()
    few = one[state % (state.nunique() // (FEW // each + 1)) == 0][:FEW]
    took, asked = _searched(few)
    report(f"the referee on {len(few)} rows", f"{asked / took:.0%} of the search", "≤ 15 %", f"{took:.1f} s")
    found = fl.discover(few, accuracy=fl.Accuracy(**ACCURACY), progress=False)
    began = time.perf_counter()
    fl.referee(found, referee="simulate", tables=TABLES, progress=False)
    simulated = time.perf_counter() - began
    report(f"  {TABLES} simulated tables / one search", f"{simulated / took:.1f} ×", "≤ 25 ×", f"{simulated:.0f} s")
    _one_row(report, one[one["buckled"] == 0][:1])


def _searched(part: pd.DataFrame) -> tuple[float, float]:
    """Seconds of a search with the whole library, and of these the referee's."""
    rows = rows_of(part)
    samples = list(np.unique(part["sample"]))

    def build(names: list[str]) -> Model:
        return build_model("continuum", {}, names, samples)

    question = question_of_rows(build, part.columns, rows, Accuracy.engineering(**ACCURACY), 0)
    looked, spent = searching.looked_at, 0.0

    def timed(*given: object) -> object:
        nonlocal spent
        began = time.perf_counter()
        said = looked(*given)  # type: ignore[arg-type]
        spent += time.perf_counter() - began
        return said

    searching.looked_at = timed  # type: ignore[assignment]
    began = time.perf_counter()
    try:
        searching.search(question)
    finally:
        searching.looked_at = looked
    return time.perf_counter() - began, spent


def _one_row(report: Report, row: pd.DataFrame) -> None:
    """Seconds until `discover` says of one row that it tells nothing."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "row.csv"
        row.to_csv(path, index=False)
        command = [sys.executable, "discover.py", "data=csv", f"data.path={path}", "train=all"]
        answer = float("nan")
        for _ in range(2):  # the first one compiles
            began = time.perf_counter()
            with subprocess.Popen(
                [*command, f"hydra.run.dir={folder}/run"], cwd=ROOT, stdout=subprocess.PIPE, text=True, bufsize=1
            ) as told:
                assert told.stdout is not None
                for line in told.stdout:
                    if line.startswith("Undecided"):
                        answer = time.perf_counter() - began
        report("discover.py on one row, to its answer", f"{answer:.1f} s", "≤ 3 s")
