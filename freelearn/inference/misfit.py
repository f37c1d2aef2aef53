"""What a fitted model's residuals say beside what the measuring alone would leave."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd
import torch

from freelearn.inference.failures import Failure, failures, inputs_of
from freelearn.inference.noise import Whitener, sensitivities
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.error import load_scale
from freelearn.measurements.states import States, kinematic_state, measured_loads
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
    loads = measured_loads(kept)
    names = {"force_pred_n": "force_n", "moment_pred_nmm": "moment_nmm"}
    residual = measured_loads(kept[list(names)].rename(columns=names)) - loads
    states = States.from_table(predictions)[torch.as_tensor(rows)]
    state = torch.as_tensor(kinematic_state(predictions)[rows])
    variance = Whitener(sensitivities(model, states), state, accuracy).variance
    tested = torch.as_tensor((kept["split"] == "test").to_numpy(copy=True))
    scored = tested if bool(tested.any()) else ~tested
    floor = float((variance[scored] / load_scale(loads[scored]) ** 2).sum(1).mean().sqrt())
    inputs = inputs_of(predictions).iloc[rows].reset_index(drop=True)
    regional = failures(inputs, residual.numpy(), load_scale(loads).numpy(), variance.sqrt().numpy())
    return Misfit(regional, floor)
