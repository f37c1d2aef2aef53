"""Where a fitted model fails, in words."""

from __future__ import annotations

from collections.abc import Mapping
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


def where_it_fails(model: Model, predictions: pd.DataFrame, accuracy: Mapping[str, Any] | str) -> list[Failure]:
    """Regions of the inputs by their share of the squared error, worst first.

    predictions: whole samples, in the columns of predictions.csv. accuracy: as `data.accuracy`; without a stated one,
    or with too few rows, there is nothing to say.
    """
    predictions = predictions.reset_index(drop=True)
    rows = usable(predictions).index.to_numpy()
    if isinstance(accuracy, str) or len(rows) < FEWEST:
        return []
    kept = predictions.iloc[rows]
    residual = np.stack(
        [
            (kept["force_pred_n"] - kept["force_n"]).to_numpy(),
            (kept["moment_pred_nmm"] - kept["moment_nmm"]).to_numpy() * NMM,
        ],
        axis=1,
    )
    scale = np.array([kept["force_n"].abs().max(), kept["moment_nmm"].abs().max() * NMM])
    scale[scale == 0] = 1.0
    states = States.from_table(predictions)[torch.as_tensor(rows)]
    state = torch.as_tensor(kinematic_state(predictions)[rows])
    noise = Whitener(sensitivities(model, states), state, Accuracy.from_settings(accuracy)).variance.sqrt().numpy()
    return failures(inputs_of(predictions).iloc[rows].reset_index(drop=True), residual, scale, noise)
