"""What a table's rows show in the channels of their bed, as plain arrays: reading a table needs no torch."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.measurements.beds import FORCE, MOMENT, Bed, bed_of
from freelearn.measurements.usable import SLACK


def shown_readings(table: pd.DataFrame, predicted: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values (N, 2) SI, zero where nothing was measured; whether each is there, (N, 2) bool; and in which rows the tube
    hangs loose, (N,) bool.

    table: a measurement table; predicted: what a model says there, of the columns of predictions.csv."""
    bed = bed_of(table)
    value, present = _columns(table, bed, predicted)
    slack = np.zeros(len(table), dtype=bool)
    if SLACK in table and FORCE in bed.measured:
        slack = table[SLACK].to_numpy(np.float64) == 1
    # A tube that hangs loose carries no moment that could tell anything.
    present = present & ~(slack[:, None] & np.array([q is MOMENT for q in bed.readings]))
    return np.where(present, value, 0.0), present, slack


def _columns(table: pd.DataFrame, bed: Bed, predicted: bool) -> tuple[np.ndarray, np.ndarray]:
    """Values (N, 2) SI of the bed's channels, and whether each is there."""
    blank = np.full(len(table), np.nan)
    columns = []
    for quantity in bed.readings:
        name = quantity.predicted if predicted else quantity.column
        there = quantity in bed.measured and name in table
        columns.append(table[name].to_numpy(np.float64) * quantity.factor if there else blank)
    value = np.stack(columns, axis=1)
    return value, np.isfinite(value)
