"""The folder of a run of train or discover, read back: its model, its rows, what is known of their accuracy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.sets import CONSTITUENT_SET, rows_of_set
from freelearn.models.base import Model
from freelearn.models.build import load_model
from freelearn.models.own import load_own_code
from freelearn.models.predicted import usable
from freelearn.results.digests import check_files, read_document
from freelearn.results.run import seen_rows

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
