"""The figures of a run in TensorBoard."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from torch.utils.tensorboard import SummaryWriter

from freelearn.evaluate.curve import model_curves
from freelearn.evaluate.files import training_samples
from freelearn.evaluate.run import Run
from freelearn.plots.canvas import to_rgb
from freelearn.plots.curves import curves
from freelearn.plots.parity import parity
from freelearn.plots.residual_map import residual_map
from freelearn.plots.states import pick_states, state_title


def log_figures(run: Run, predictions: pd.DataFrame, folder: Path, simulated: bool) -> None:
    """Writes the parity, residual and load-curve figures."""
    title = f"{run.model.name} fitted on {run.train}"
    with SummaryWriter(str(folder)) as writer:
        own = training_samples(run, predictions)
        for tag, figure in (
            ("parity", parity(own, title, simulated)),
            ("residual_map", residual_map(own, title, simulated)),
        ):
            writer.add_image(tag, to_rgb(figure), dataformats="HWC")
        for rows in pick_states(own):
            measured = own.iloc[rows]
            where = state_title(measured)
            lines = model_curves({run.model.name: run.model}, own, rows)
            figure = curves(measured, lines, f"{title}: {where}", simulated)
            writer.add_image(f"curves/{where}", to_rgb(figure), dataformats="HWC")
