"""What a fitted model's residuals say beside what the measuring alone would leave."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd
import torch

from freelearn.inference.failures import Failure, failures, inputs_of
from freelearn.inference.noise import noise_floor, variances
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.error import load_scale
from freelearn.measurements.rows import Readings
from freelearn.measurements.states import States
from freelearn.models.base import Model
from freelearn.models.predicted import usable

# Fewer rows are no region.
FEWEST = 40


@dataclass(frozen=True)
class Misfit:
    """failures: regions by their share of the squared error, worst first. noise_floor: the E that a perfect model
    would have on the training set's own test rows (all rows where none were fitted), a fraction."""

    failures: list[Failure]
    noise_floor: float


def misfit(model: Model, predictions: pd.DataFrame, accuracy: Accuracy) -> Misfit | None:
    """Where the model fails, and how small its error could be; None with too few rows.

    predictions: whole samples, in the columns of predictions.csv.
    """
    predictions = predictions.reset_index(drop=True)
    rows = usable(predictions).index.to_numpy(copy=True)
    if len(rows) < FEWEST:
        return None
    # Of many rows copies count: none where all are used, and nothing is held longer than it is needed.
    every = len(rows) == len(predictions)
    kept = predictions if every else predictions.iloc[rows]
    states, readings = States.from_table(predictions), Readings.from_table(kept)
    bed = states.bed
    variance = variances(model, states if every else states[torch.as_tensor(rows)], accuracy, readings.present)
    del states, rows
    tested = torch.as_tensor((kept["split"] == "test").to_numpy(copy=True))
    scored = tested if bool(tested.any()) else ~tested
    floor = noise_floor(variance[scored], readings.present[scored], load_scale(readings.value[scored]))
    missed = readings.missed(Readings.from_table(kept, predicted=True).value)
    residual = torch.where(readings.present, missed, torch.nan).numpy()
    scale = load_scale(readings.value).numpy()
    del readings, missed
    inputs = inputs_of(predictions)
    inputs = inputs if every else inputs.loc[kept.index].reset_index(drop=True)
    return Misfit(failures(inputs, residual, scale, variance.sqrt_().numpy(), bed), floor)
