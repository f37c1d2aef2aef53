"""What a fitted model's residuals say beside what the measuring alone would leave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.data.states import States, kinematic_state
from freelearn.discover.failures import Failure, failures, inputs_of
from freelearn.discover.noise import Accuracy, Whitener, sensitivities
from freelearn.models.base import Model
from freelearn.plots.states import usable
from freelearn.units import NMM

# Fewer rows are no region.
FEWEST = 40


@dataclass(frozen=True)
class Misfit:
    """failures: regions by their share of the squared error, worst first. noise_floor: the E that a perfect model
    would have on the training set's own test rows (all rows where none were fitted), a fraction."""

    failures: list[Failure]
    noise_floor: float


def misfit(model: Model, predictions: pd.DataFrame, accuracy: Mapping[str, Any] | str) -> Misfit | None:
    """Where the model fails, and how small its error could be; None without a stated accuracy or with too few rows.

    predictions: whole samples, in the columns of predictions.csv. accuracy: as `data.accuracy`.
    """
    predictions = predictions.reset_index(drop=True)
    rows = usable(predictions).index.to_numpy(copy=True)
    if isinstance(accuracy, str) or len(rows) < FEWEST:
        return None
    kept = predictions.iloc[rows]
    residual, loads = (
        np.stack([force.to_numpy(), moment.to_numpy() * NMM], axis=1)
        for force, moment in (
            (kept["force_pred_n"] - kept["force_n"], kept["moment_pred_nmm"] - kept["moment_nmm"]),
            (kept["force_n"], kept["moment_nmm"]),
        )
    )
    states = States.from_table(predictions)[torch.as_tensor(rows)]
    state = torch.as_tensor(kinematic_state(predictions)[rows])
    variance = Whitener(sensitivities(model, states), state, Accuracy.from_settings(accuracy)).variance.numpy()
    held_out = (kept["split"] == "test").to_numpy()
    if not held_out.any():
        held_out[:] = True
    floor = float(np.sqrt((variance[held_out] / _largest(loads[held_out]) ** 2).sum(1).mean()))
    inputs = inputs_of(predictions).iloc[rows].reset_index(drop=True)
    return Misfit(failures(inputs, residual, _largest(loads), np.sqrt(variance)), floor)


def _largest(loads: np.ndarray) -> np.ndarray:
    """Largest force and moment, (2,); 1 where there is none."""
    largest = np.abs(loads).max(0)
    return np.where(largest > 0, largest, 1.0)
