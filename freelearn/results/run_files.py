"""The files of one run. Each is written beside its place and renamed, `results.json` last: it marks a whole run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.csv_text import csv_text
from freelearn.errors import UserError
from freelearn.files import write_text
from freelearn.measurements.beds import bed_of
from freelearn.models.build import save_checkpoint
from freelearn.models.predicted import predicted_table
from freelearn.results.estimate import parameter_table
from freelearn.results.fit_report import fit_report
from freelearn.results.formats import all_finite, ascii_minus, finite
from freelearn.results.origin import Origin
from freelearn.results.run import Run
from freelearn.results.states import rows_of_set


def check_folder(folder: Path) -> None:
    """Makes the run's folder and sees that it can be written to. Raises UserError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as problem:
        raise UserError(
            f"Cannot write to the output folder {folder}: {problem.strerror}. Set hydra.run.dir=…"
        ) from None


def write_run(run: Run, table: pd.DataFrame, folder: Path, origin: Origin) -> None:
    """Writes predictions.csv (`table`, from `predictions`), fit_report.txt, checkpoint.ckpt and results.json."""
    write_text(folder / "predictions.csv", csv_text(table, "%.10g"))
    write_text(folder / "fit_report.txt", report(run))
    save_checkpoint(run.model, folder / "checkpoint.ckpt")
    write_text(folder / "results.json", json.dumps(results(run, origin), indent=2, allow_nan=False) + "\n")


def predictions(run: Run) -> pd.DataFrame:
    """The run's table with splits and predicted loads: predictions.csv."""
    return predicted_table(run.table, run.labels, run.prediction)


def training_samples(run: Run, predictions: pd.DataFrame) -> pd.DataFrame:
    """Rows of the samples that were fitted; all rows where nothing was. predictions: of `predictions`."""
    return rows_of_set(predictions, run.train) if run.uncertainty else predictions


def results(run: Run, origin: Origin) -> dict[str, Any]:
    """Everything in results.json. Numbers that do not exist are null.

    `comparison`, `noise_floor` and `failures` stand there where they were computed, whoever looks on.
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
