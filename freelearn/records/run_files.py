"""The files of one run, written and read back. `results.json` is written last: it marks a whole run."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.csv_text import csv_blocks
from freelearn.common.errors import UserError, cannot_write
from freelearn.common.files import remove_unfinished, write_text, write_whole
from freelearn.common.formats import all_finite, ascii_minus, finite
from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import bed_of
from freelearn.data.sets import CONSTITUENT_SET, rows_of_set
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import predicted_table, usable
from freelearn.physics.models.build import load_model, save_checkpoint
from freelearn.physics.models.own_files import load_own_code
from freelearn.records.estimates import parameter_table
from freelearn.records.fit_report import fit_report
from freelearn.records.left_out_readings import LeftOutReadings
from freelearn.records.provenance import Origin, check_files, read_document, with_digests
from freelearn.records.run import Run, seen_rows
from freelearn.records.sampling import sampling_notes

# The files of one run. Each is written beside its place and renamed, `results.json` last: it marks a whole run.

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
    measured, slow = bed_of(run.table).measured, sampling_notes(run.model, run.table)
    return fit_report(
        run.model, run.uncertainty, run.start, run.method, run.message, epochs, run.counts(), measured, slow
    )


# The folder of a run of train or discover, read back: its model, its rows, what is known of their accuracy.

# What marks a whole run, and the table of its rows.
KINDS = {"results.json": "predictions.csv", "discovery.json": "predictions_after.csv"}


@dataclass(frozen=True)
class RunFolder:
    """content: of results.json or discovery.json. table: rows with the model's predictions, in the columns of
    predictions.csv. covariance: of the declared parameters, SI (k, k), NaN where it is not known. accuracy: of the
    measuring, None where the run does not know it."""

    folder: Path
    content: Mapping[str, Any]
    model: Model[Any]
    table: pd.DataFrame
    covariance: np.ndarray
    accuracy: Accuracy | None

    @property
    def own(self) -> np.ndarray:
        """Rows of the samples that were fitted, usable and with an answer: all of these where nothing was fitted."""
        inside = self.table.index.isin(rows_of_set(self.table, str(self.content["train"])).index)
        shown: np.ndarray = inside & self.table.index.isin(usable(self.table).index)
        return shown

    @property
    def by_states(self) -> bool:
        """Whether whole kinematic states were held out, so that bands are those of a state that was not visited."""
        return str(self.content.get("split", "states")) == "states"

    @cached_property
    def left_out(self) -> LeftOutReadings | None:
        """What fits of a search say of the rows of states that they did not see; None where the table does not tell."""
        return LeftOutReadings.from_table(self.table)

    @property
    def seen(self) -> np.ndarray:
        """Rows that the fit saw, (N,) bool."""
        if self.content["train"] == CONSTITUENT_SET:
            return np.zeros(len(self.table), dtype=bool)
        seen: np.ndarray = self.own & seen_rows(self.model, self.table["split"])
        return seen


def read_run(folder: str | Path) -> RunFolder:
    """The run in a folder. Raises UserError.

    Effects and models of the user's own are read from the files that FREELEARN_EFFECTS and FREELEARN_MODELS name, and
    from nowhere else: nothing in the folder is executed."""
    folder = Path(folder)
    if not folder.is_dir():
        raise UserError(f"No folder at {folder}: give that of a run of train or discover, run=FOLDER.")
    kind, content = _document(folder)
    load_own_code()
    model = load_model(folder / "checkpoint.ckpt")
    try:
        table = pd.read_csv(folder / KINDS[kind])
        stated = content.get("accuracy")
        accuracy = Accuracy(**stated) if stated else None
        covariance = _covariance(content.get("covariance"), len(model.declared))
        rows_of_set(table, str(content["train"]))
    except (OSError, ValueError, KeyError, TypeError) as problem:
        raise UserError(f"{folder} is not the folder of a whole run: {problem}.") from None
    return RunFolder(folder, content, model, table, covariance, accuracy)


def _document(folder: Path) -> tuple[str, dict[str, Any]]:
    """What marks the folder's run, and its content. Of a train and a discover in one folder that whose files are there:
    the later one. Raises UserError where they are not as they were written."""
    problem = UserError(f"{folder} is not the folder of a whole run: it holds neither {' nor '.join(KINDS)}.")
    for kind in [name for name in KINDS if (folder / name).is_file()]:
        try:
            content = read_document(folder / kind)
            check_files(content, folder)
            return kind, content
        except UserError as mistake:
            problem = mistake
    raise problem


def _covariance(stored: Any, count: int) -> np.ndarray:
    known = np.full((count, count), np.nan)
    if stored:
        there = np.array(stored, dtype=np.float64)
        return there if there.shape == known.shape else known
    return known
