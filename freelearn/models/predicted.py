"""Measurement tables with a model's predictions beside the measured loads: the columns of predictions.csv."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.measurements.beds import bed_of
from freelearn.measurements.usable import usable_rows
from freelearn.models.prediction import Prediction, Status


def predicted_table(table: pd.DataFrame, split: str | np.ndarray, prediction: Prediction) -> pd.DataFrame:
    """The measurement table with `split`, `status` and what is predicted; this is blank without an equilibrium.

    split: of every row, or one for all. prediction: of the table's rows.
    """
    status, bed = prediction.status.numpy(), bed_of(table)
    loads = np.where((status == Status.NO_EQUILIBRIUM)[:, None], np.nan, prediction.loads.numpy())
    words = np.array([s.name.lower() for s in Status], dtype=object)[status]
    shown = {q.predicted: loads[:, i] / q.factor for i, q in enumerate(bed.readings) if q in bed.measured}
    return table.assign(split=split, **shown, status=words)


def usable(predictions: pd.DataFrame) -> pd.DataFrame:
    """Rows that are fitted or scored: neither buckled nor left out, and with a valid prediction."""
    kept = answered(predictions)
    return predictions if kept.all() else predictions[kept]


def answered(predictions: pd.DataFrame) -> np.ndarray:
    """Which rows are `usable`, (N,) bool."""
    kept: np.ndarray = usable_rows(predictions) & (predictions["status"] == "ok").to_numpy()
    return kept
