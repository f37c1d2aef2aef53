"""The files of one run. Each is written beside its place and renamed, `results.json` last: it marks a whole run."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.csv_text import csv_blocks
from freelearn.errors import cannot_write
from freelearn.files import remove_unfinished, write_text, write_whole
from freelearn.measurements.beds import bed_of
from freelearn.measurements.sets import rows_of_set
from freelearn.models.build import save_checkpoint
from freelearn.models.predicted import predicted_table
from freelearn.results.digests import with_digests
from freelearn.results.estimate import parameter_table
from freelearn.results.fit_report import fit_report
from freelearn.results.formats import all_finite, ascii_minus, finite
from freelearn.results.origin import Origin
from freelearn.results.run import Run

# What marks a whole run.
RESULTS = "results.json"


def check_folder(folder: Path) -> None:
    """Makes the run's folder and sees that it can be written to. Raises UserError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        remove_unfinished(folder)
        # Another command in the same folder leaves this one's alone.
        probe = folder / f".writable.{os.getpid()}"
        probe.touch()
        probe.unlink()
    except (OSError, ValueError) as problem:
        raise cannot_write(folder, problem) from None


def begin_results(folder: Path, mark: str = RESULTS) -> None:
    """Takes away the mark of an earlier whole result before any of its files is replaced, and makes the folder again
    where it was deleted meanwhile. Raises UserError."""
    check_folder(folder)
    try:
        (folder / mark).unlink(missing_ok=True)
    except OSError as problem:
        raise cannot_write(folder / mark, problem) from None


def write_run(run: Run, table: pd.DataFrame, folder: Path, origin: Origin) -> None:
    """Writes predictions.csv (`table`, from `predictions`), fit_report.txt, checkpoint.ckpt and results.json."""
    write_whole(folder / "predictions.csv", lambda beside: _write_table(table, beside))
    write_text(folder / "fit_report.txt", report(run))
    save_checkpoint(run.model, folder / "checkpoint.ckpt")
    whole = with_digests(results(run, origin), folder, ["predictions.csv", "checkpoint.ckpt"])
    write_text(folder / RESULTS, json.dumps(whole, indent=2, allow_nan=False) + "\n")


def _write_table(table: pd.DataFrame, path: Path) -> None:
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.writelines(csv_blocks(table, "%.10g"))


def predictions(run: Run) -> pd.DataFrame:
    """The run's table with splits and predicted loads: predictions.csv."""
    return predicted_table(run.table, run.labels, run.prediction)


def training_samples(run: Run, predictions: pd.DataFrame) -> pd.DataFrame:
    """Rows of the samples that were fitted; all rows where nothing was. predictions: of `predictions`."""
    return rows_of_set(predictions, run.train) if run.uncertainty else predictions


def results(run: Run, origin: Origin) -> dict[str, Any]:
    """Everything in results.json. Numbers that do not exist are null.

    `learned` are coefficients beside the parameters. `comparison`, `noise_floor` and `failures` stand there where they
    were computed, whoever looks on.
    """
    content: dict[str, Any] = {
        "model": run.model.name,
        "train": run.train,
        "fit": run.method,
        "effects": [e.name for e in run.model.effects],
        "parameters": {estimate.name: estimate.plain() for estimate in run.estimates()},
        "tests": {name: e.plain() for name, e in run.errors.items()},
        "counts": run.counts(),
        "seconds": run.seconds,
        "fit_seconds": run.fit_seconds,
        "fit_reused": run.reused,
        "outcome": run.message,
        **origin.plain(),
    }  # fmt: skip
    if run.model.coefficients:
        content["learned"] = run.model.coefficients
    if run.uncertainty:
        content["freedom"] = run.uncertainty.freedom
        content["covariance"] = [[finite(value) for value in row] for row in run.covariance]
    if run.comparison:
        content["comparison"] = {name: pair.plain() for name, pair in run.comparison.items()}
    if run.accuracy:
        content["accuracy"] = vars(run.accuracy)
    if run.misfit:
        content["noise_floor"] = run.misfit.noise_floor
        content["failures"] = all_finite([failure.numbers() for failure in run.misfit.failures])
    return content


def report(run: Run) -> str:
    """Text of fit_report.txt."""
    if run.uncertainty is None:
        values = ascii_minus(parameter_table(run.estimates()).text("    "))
        return f"[[Model]]\n    {run.model.name}\n[[Variables]] (nothing was fitted)\n{values}\n"
    epochs = run.history[-1][0] if run.history else 0
    measured = bed_of(run.table).measured
    return fit_report(run.model, run.uncertainty, run.start, run.method, run.message, epochs, run.counts(), measured)
