"""Forces and moments that pressures reach at a place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import torch

from freelearn.measurements.beds import FORCE, KINEMATIC, MOMENT
from freelearn.results.fitted_model import FittedModel
from freelearn.results.map_scope import fitted_samples, load_notes, lost_note, refused, samples_known, tells_loads
from freelearn.results.pressure_grid import PressureGrid
from freelearn.results.reachable import Reachable, crossed, reached_points
from freelearn.results.reached import Reached
from freelearn.results.settled import settled


def load_polygon(
    fitted: FittedModel,
    elongation_mm: float | Sequence[float] = 0.0,
    twist_deg: float | Sequence[float] = 0.0,
    samples: Sequence[int] | None = None,
) -> Reachable:
    """Loads at one place, or at several, over all pressures within reach: of one actuator a curve, of several on an end
    block a region, with its convex hull.

    The pressures are on a grid (PressureGrid), so that the hull lies inside the true one by less than a step of it.
    Raises UserError.
    """
    if not tells_loads(fitted):
        raise refused(fitted)
    table = fitted.table()
    reached = Reached.of(table)
    grid = PressureGrid.between(reached.quantities, reached.low, reached.high)
    places = np.stack(np.broadcast_arrays(np.atleast_1d(elongation_mm), np.atleast_1d(twist_deg)), axis=1)
    cases = pd.DataFrame(
        [(n, *place) for n in samples_known(fitted, samples) for place in places],
        columns=["sample", "elongation_mm", "twist_deg"],
    )
    rows = crossed(grid, cases)
    with torch.no_grad():
        found = fitted.model(settled(fitted, rows, KINEMATIC))
    points = reached_points(rows, grid, (FORCE, MOMENT), found)
    notes = (*load_notes(fitted), *lost_note(points, "no equilibrium"))
    return Reachable(points, grid, KINEMATIC.state, (FORCE, MOMENT), reached, fitted_samples(fitted, table), notes)
