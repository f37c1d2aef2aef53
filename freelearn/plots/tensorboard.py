"""The figures of a run in TensorBoard."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import torch
from torch.utils.tensorboard import SummaryWriter

from freelearn.data.sets import samples_of
from freelearn.data.states import States
from freelearn.evaluate.run import Run
from freelearn.models.prediction import Status
from freelearn.plots.canvas import to_rgb
from freelearn.plots.curves import curves
from freelearn.plots.parity import parity
from freelearn.plots.residual_map import residual_map
from freelearn.plots.states import PLACE, pick_states
from freelearn.units import NMM

CURVE_POINTS = 60


def log_figures(run: Run, predictions: pd.DataFrame, folder: Path, simulated: bool) -> None:
    """Writes the parity, residual and load-curve figures."""
    title = f"{run.model.name} fitted on {run.train}"
    with SummaryWriter(str(folder)) as writer:
        own = _training_samples(run, predictions)
        for tag, figure in (
            ("parity", parity(own, title, simulated)),
            ("residual_map", residual_map(own, title, simulated)),
        ):
            writer.add_image(tag, to_rgb(figure), dataformats="HWC")
        for place in pick_states(own):
            measured = predictions[(predictions[PLACE] == pd.Series(dict(zip(PLACE, place, strict=True)))).all(axis=1)]
            where = "sample {}, {:+.3g} mm, {:+.4g}°".format(*place)
            figure = curves(measured, {run.model.name: model_curve(run, measured)}, f"{title}: {where}", simulated)
            writer.add_image(f"curves/{where}", to_rgb(figure), dataformats="HWC")


def _training_samples(run: Run, predictions: pd.DataFrame) -> pd.DataFrame:
    if run.found is None:
        return predictions
    sample = predictions["sample"].to_numpy()
    return predictions[np.isin(sample, samples_of(run.train, sample))]


def model_curve(run: Run, measured: pd.DataFrame) -> pd.DataFrame:
    """Predicted loads from zero to a little beyond the highest pressure at the state of `measured`.

    Columns pressure_kpa, force_pred_n, moment_pred_nmm, extrapolated (outside the measured, un-buckled pressures).
    """
    fitted = measured.loc[measured["buckled"] == 0, "pressure_kpa"]
    top = max(measured["pressure_kpa"].max(), 0.0)
    pressure = np.union1d(np.linspace(min(0.0, fitted.min()), top, CURVE_POINTS), [fitted.min(), fitted.max()])
    rows = measured.iloc[[0] * len(pressure)].assign(pressure_kpa=pressure)
    with torch.no_grad():
        loads, status = run.model(States.from_table(rows).replace(direction=torch.zeros(len(pressure)).double()))
    loads[status == Status.NO_EQUILIBRIUM] = torch.nan
    return pd.DataFrame(
        {
            "pressure_kpa": pressure,
            "force_pred_n": loads[:, 0].numpy(),
            "moment_pred_nmm": loads[:, 1].numpy() / NMM,
            "extrapolated": (pressure < fitted.min()) | (pressure > fitted.max()),
        }
    )
