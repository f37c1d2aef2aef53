"""What a fitted model's residuals say beside what the measuring alone would leave."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd
import torch

from freelearn.inference.failures import Failure, failures, inputs_of
from freelearn.inference.noise import Whitener, noise_floor, sensitivities
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.error import load_scale
from freelearn.measurements.rows import Readings, Rows
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
    kept = predictions.iloc[rows]
    used = Rows.from_table(predictions)[torch.as_tensor(rows)]
    bed, readings = used.states.bed, used.readings
    missed = readings.missed(Readings.from_table(kept, predicted=True).value)
    residual = torch.where(readings.present, missed, torch.nan)
    state = torch.as_tensor(used.state)
    whiten = Whitener(sensitivities(model, used.states), state, accuracy, bed=bed, present=readings.present)
    tested = torch.as_tensor((kept["split"] == "test").to_numpy(copy=True))
    scored = tested if bool(tested.any()) else ~tested
    floor = noise_floor(whiten.variance[scored], readings.present[scored], load_scale(readings.value[scored]))
    inputs = inputs_of(predictions).iloc[rows].reset_index(drop=True)
    scale = load_scale(readings.value).numpy()
    return Misfit(failures(inputs, residual.numpy(), scale, whiten.variance.sqrt().numpy(), bed), floor)
