"""The figures of a run in TensorBoard."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from freelearn.data.logs import is_log
from freelearn.queries.curves.log_spectra import Spectrum
from freelearn.queries.curves.model_curves import StateCurves
from freelearn.queries.curves.shown_states import state_title
from freelearn.records.run import Run
from freelearn.report.plots.canvas import to_rgb
from freelearn.report.plots.curve_plots import curves
from freelearn.report.plots.log_plots import recording_figure
from freelearn.report.plots.residual_plots import residual_map
from freelearn.report.plots.simple_plots import parity
from freelearn.report.tensorboard_log import event_file


def log_figures(
    run: Run,
    own: pd.DataFrame,
    shown: Sequence[StateCurves],
    folder: Path,
    simulated: bool,
    spectra: Sequence[Spectrum] = (),
) -> None:
    """Adds the parity, residual and load-curve figures, of a log its worst recording, to what log_run wrote. own,
    shown, spectra: as of report_run."""
    title = f"{run.model.name} fitted on {run.train}"
    with event_file(folder, go_on=True) as writer:
        for tag, figure in (
            ("parity", parity(own, title, simulated)),
            ("residual_map", residual_map(own, title, simulated)),
        ):
            writer.add_image(tag, to_rgb(figure), dataformats="HWC")
        if is_log(own):
            figure = recording_figure(own, spectra, title, simulated)
            writer.add_image("recording", to_rgb(figure), dataformats="HWC")
        for measured, lines in shown:
            where = state_title(measured)
            figure = curves(measured, lines, f"{title}: {where}", simulated)
            writer.add_image(f"curves/{where}", to_rgb(figure), dataformats="HWC")
