"""The curves of a run at a few of its states, with the 95 % bands of its model."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch

from freelearn.answer.bands import Bands
from freelearn.measurements.rows import Rows
from freelearn.models.predicted import answered
from freelearn.results.curve import StateCurves, state_curves
from freelearn.results.run import Run, seen_rows
from freelearn.results.states import pick_states


def run_curves(run: Run, own: pd.DataFrame, banded: bool, by_states: bool) -> list[StateCurves]:
    """Curves at the best, a middling and the worst predicted state. own: rows of the samples that were fitted, in the
    columns of predictions.csv; banded: with the bands; by_states: whether whole kinematic states were held out."""
    # First what needs no states: of many rows they take as much as the table.
    name, picked, rows = run.model.name, pick_states(own), Rows.from_table(own)
    bands = {name: run_bands(run, own, rows, by_states)} if banded else {}
    return state_curves({name: run.model}, own, picked, rows.states, bands)


def run_bands(run: Run, own: pd.DataFrame, rows: Rows, by_states: bool) -> Bands | None:
    """How far a new measurement may lie from what the run's model says; None where no row tells it.

    own, by_states: as of run_curves; rows: all of own."""
    seen = seen_rows(run.model, own["split"]) if run.uncertainty else np.zeros(len(own), dtype=bool)
    compared = answered(own)
    if not compared.all():
        rows, seen = rows[torch.as_tensor(compared)], seen[compared]
    fitted = torch.tensor(seen)
    return Bands.of(run.model, rows, fitted, run.covariance, run.accuracy, by_states)
