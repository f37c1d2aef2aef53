"""A model's loads against pressure at one kinematic state."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch

from freelearn.data.states import States
from freelearn.models.base import Model
from freelearn.models.prediction import Status
from freelearn.units import NMM

POINTS = 60


def model_curve(model: Model, measured: pd.DataFrame) -> pd.DataFrame:
    """Predicted loads from zero to the highest pressure at the state of `measured` (measurement columns).

    Columns pressure_kpa, force_pred_n, moment_pred_nmm (blank without an equilibrium), extrapolated (outside the
    measured, un-buckled pressures). Pressure counts as neither rising nor falling.
    """
    fitted = measured.loc[measured["buckled"] == 0, "pressure_kpa"]
    if not len(fitted):
        fitted = measured["pressure_kpa"]
    top = max(measured["pressure_kpa"].max(), 0.0)
    pressure = np.union1d(np.linspace(min(0.0, fitted.min()), top, POINTS), [fitted.min(), fitted.max()])
    rows = measured.iloc[[0] * len(pressure)].assign(pressure_kpa=pressure)
    with torch.no_grad():
        loads, status = model(States.from_table(rows).replace(direction=torch.zeros(len(pressure)).double()))
    loads[status == Status.NO_EQUILIBRIUM] = torch.nan
    return pd.DataFrame(
        {
            "pressure_kpa": pressure,
            "force_pred_n": loads[:, 0].numpy(),
            "moment_pred_nmm": loads[:, 1].numpy() / NMM,
            "extrapolated": (pressure < fitted.min()) | (pressure > fitted.max()),
        }
    )
