"""A model's loads along the pressure steps of one kinematic state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.measurements.states import States
from freelearn.measurements.usable import usable_rows
from freelearn.models.base import Model
from freelearn.models.prediction import Status
from freelearn.units import KPA, NMM

POINTS = 60


# A kinematic state's measured rows, and each model's curve there by the model's name.
StateCurves = tuple[pd.DataFrame, dict[str, pd.DataFrame]]


def state_curves(
    models: Mapping[str, Model[Any]], table: pd.DataFrame, picked: Sequence[np.ndarray], states: States | None = None
) -> list[StateCurves]:
    """Rows and curves of each picked state. picked: positions in `table` of a state's rows, in time order.

    states: those of the table's rows, where the table alone does not tell what they remember; some effects remember
    what the sample went through before.
    """
    states = States.from_table(table) if states is None else states
    usable = usable_rows(table)
    return [
        (table.iloc[rows], {n: model_curve(m, states[torch.as_tensor(rows)], usable[rows]) for n, m in models.items()})
        for rows in picked
    ]


def model_curve(model: Model[Any], states: States, usable: np.ndarray) -> pd.DataFrame:
    """Predicted loads along the path that the pressure took: from zero to the first step, then from step to step.

    states: one kinematic state's rows in time order; usable: (N,) bool of them. Points between two steps remember what
    the later one does (its direction, its times), so that rising and falling pressure draw two branches.
    Columns, in the order of the path: pressure_kpa, force_pred_n, moment_pred_nmm (blank without an equilibrium),
    extrapolated (outside the pressures of usable rows).
    """
    per_step = max(1, round(POINTS / len(states)))
    step = np.repeat(np.arange(len(states)), per_step)
    share = np.tile(np.arange(1, per_step + 1) / per_step, len(states))
    pressure = states.pressure.numpy()
    before = np.r_[0.0, pressure[:-1]][step]
    along = np.r_[0.0, before + share * (pressure[step] - before)]
    path = states[torch.as_tensor(np.r_[0, step])].replace(pressure=torch.as_tensor(along))
    with torch.no_grad():
        loads, status = model(path)
    loads[status == Status.NO_EQUILIBRIUM] = torch.nan
    fitted = pressure[usable] if usable.any() else pressure
    slack = 1e-9 * np.abs(pressure).max()
    return pd.DataFrame(
        {
            "pressure_kpa": along / KPA,
            "force_pred_n": loads[:, 0].numpy(),
            "moment_pred_nmm": loads[:, 1].numpy() / NMM,
            "extrapolated": (along < fitted.min() - slack) | (along > fitted.max() + slack),
        }
    )
