"""Elongations and twists that pressures reach under a hung load."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
import torch

from freelearn.measurements.beds import DEAD_LOAD, ELONGATION, KINEMATIC, TWIST
from freelearn.measurements.states import States
from freelearn.models.base import BLOCK
from freelearn.models.hang import hang
from freelearn.models.prediction import Prediction
from freelearn.results.fitted_model import FittedModel
from freelearn.results.map_scope import fitted_samples, load_notes, lost_note, refused, samples_known, tells_poses
from freelearn.results.pressure_grid import PressureGrid
from freelearn.results.reachable import Reachable, crossed, reached_points
from freelearn.results.reached import Reached
from freelearn.results.settled import settled


def reachable_poses(
    fitted: FittedModel, force_n: float = 0.0, moment_nmm: float = 0.0, samples: Sequence[int] | None = None
) -> Reachable:
    """Where an end that carries these loads comes to rest, over all pressures within reach: a free end by default.

    Rows without a stable equilibrium are blank, and counted. Raises UserError.
    """
    if not tells_poses(fitted):
        raise refused(fitted)
    table = fitted.table()
    reached = Reached.of(table)
    grid = PressureGrid.between(reached.quantities, reached.low, reached.high)
    cases = pd.DataFrame({"sample": samples_known(fitted, samples), "force_n": force_n, "moment_nmm": moment_nmm})
    rows = crossed(grid, cases)
    states = settled(fitted, rows.assign(elongation_mm=0.0, twist_deg=0.0), DEAD_LOAD)
    points = reached_points(rows, grid, (ELONGATION, TWIST), _rest(fitted, states))
    notes = (*load_notes(fitted), *lost_note(points, "no stable equilibrium"))
    return Reachable(points, grid, DEAD_LOAD.state, (ELONGATION, TWIST), reached, fitted_samples(fitted, table), notes)


def _rest(fitted: FittedModel, states: States) -> Prediction:
    """Elongation [m] and twist [rad] under the loads, (N, 2), from the loads that the model gives at a place: also of a
    network, which answers by itself only on the bed that it was fitted on."""
    model = fitted.model
    with torch.no_grad():
        if fitted.bed is DEAD_LOAD:
            return model.forward(states)
        values = model.values()
        parts = [
            hang(
                states[rows], values, lambda at, v: model.chain(at.replace(bed=KINEMATIC), v),
                model.rows_of,
            )
            for rows in torch.arange(len(states)).split(BLOCK)
        ]  # fmt: skip
    return Prediction(torch.cat([part.loads for part in parts]), torch.cat([part.status for part in parts]))
