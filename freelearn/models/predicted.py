"""Measurement tables with a model's predictions beside the measured loads: the columns of predictions.csv."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.measurements.usable import usable_rows
from freelearn.models.prediction import Prediction, Status
from freelearn.units import NMM


def predicted_table(table: pd.DataFrame, split: str | np.ndarray, prediction: Prediction) -> pd.DataFrame:
    """The measurement table with `split`, `status` and predicted loads; these are blank without an equilibrium.

    split: of every row, or one for all. prediction: of the table's rows.
    """
    status = prediction.status.numpy()
    loads = np.where((status == Status.NO_EQUILIBRIUM)[:, None], np.nan, prediction.loads.numpy())
    words = np.array([s.name.lower() for s in Status])[status]
    return table.assign(split=split, force_pred_n=loads[:, 0], moment_pred_nmm=loads[:, 1] / NMM, status=words)


def usable(predictions: pd.DataFrame) -> pd.DataFrame:
    """Rows that are fitted or scored: neither buckled nor left out, and with a valid prediction."""
    return predictions[usable_rows(predictions) & (predictions["status"] == "ok").to_numpy()]
