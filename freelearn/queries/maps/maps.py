"""All maps of a fitted model: what it can push, where it can go, how stiff it is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch

from freelearn.data.beds import DEAD_LOAD, ELONGATION, FORCE, KINEMATIC, MOMENT, TWIST
from freelearn.data.states import States
from freelearn.physics.chain.dead_load import solve_dead_load
from freelearn.physics.chain.model import BLOCK
from freelearn.physics.chain.prediction import Prediction
from freelearn.queries.fitted_model import FittedModel
from freelearn.queries.maps.map_scope import (
    Ends,
    OperatingRange,
    fitted_samples,
    load_notes,
    lost_note,
    refused,
    samples_known,
    steady_states,
    tells_loads,
    tells_poses,
)
from freelearn.queries.maps.reach import PressureGrid, Reachable, crossed, reached_points
from freelearn.queries.maps.stiffness_map import StiffnessMap, stiffness_map

# Forces and moments that pressures reach at a place.


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
    reached = OperatingRange.from_predictions(table)
    grid = PressureGrid.between(reached.quantities, reached.low, reached.high)
    places = np.stack(np.broadcast_arrays(np.atleast_1d(elongation_mm), np.atleast_1d(twist_deg)), axis=1)
    cases = pd.DataFrame(
        [(n, *place) for n in samples_known(fitted, samples) for place in places],
        columns=["sample", "elongation_mm", "twist_deg"],
    )
    rows = crossed(grid, cases)
    with torch.no_grad():
        found = fitted.model(steady_states(fitted, rows, KINEMATIC))
    points = reached_points(rows, grid, (FORCE, MOMENT), found)
    notes = (*load_notes(fitted), *lost_note(points, "no equilibrium"))
    return Reachable(points, grid, KINEMATIC.state, (FORCE, MOMENT), reached, fitted_samples(fitted, table), notes)


# Elongations and twists that pressures reach under a hung load.


def reachable_poses(
    fitted: FittedModel, force_n: float = 0.0, moment_nmm: float = 0.0, samples: Sequence[int] | None = None
) -> Reachable:
    """Where an end that carries these loads comes to rest, over all pressures within reach: a free end by default.

    Rows without a stable equilibrium are blank, and counted. Raises UserError.
    """
    if not tells_poses(fitted):
        raise refused(fitted)
    table = fitted.table()
    reached = OperatingRange.from_predictions(table)
    grid = PressureGrid.between(reached.quantities, reached.low, reached.high)
    cases = pd.DataFrame({"sample": samples_known(fitted, samples), "force_n": force_n, "moment_nmm": moment_nmm})
    rows = crossed(grid, cases)
    states = steady_states(fitted, rows.assign(elongation_mm=0.0, twist_deg=0.0), DEAD_LOAD)
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
            solve_dead_load(
                states[rows], values, lambda at, v: model.chain(at.replace(bed=KINEMATIC), v),
                model.rows_of,
            )
            for rows in torch.arange(len(states)).split(BLOCK)
        ]  # fmt: skip
    return Prediction(torch.cat([part.loads for part in parts]), torch.cat([part.status for part in parts]))


__all__ = ["Maps", "Reachable", "StiffnessMap", "load_polygon", "maps", "reachable_poses", "stiffness_map"]

# An end of the plane is a place of its own from this share of the plane away from rest.
APART = 0.2
# Places along the only quantity that a bed moved.
ALONG = 5


@dataclass(frozen=True)
class Maps:
    """loads: reachable at rest, of a single sample also elsewhere in the plane; poses: of a free end; stiffness: at
    three pressures. None for what the model does not tell: a network knows only what it was fitted to."""

    loads: Reachable | None
    poses: Reachable
    stiffness: StiffnessMap | None


def maps(fitted: FittedModel) -> Maps:
    """All maps of a run, within the reach of its bed. Raises UserError where there is none."""
    if not tells_poses(fitted):
        raise refused(fitted)
    poses = reachable_poses(fitted)
    if not tells_loads(fitted):
        return Maps(None, poses, None)
    elongation, twist = zip(*_places(fitted, poses.reached), strict=True)
    return Maps(load_polygon(fitted, elongation, twist), poses, stiffness_map(fitted))


def _places(fitted: FittedModel, reached: OperatingRange) -> list[tuple[float, float]]:
    """Rest, or the nearest place to it that the bed went to; of a single sample also the plane's ends from there, or
    where the bed moved in one way alone, even steps along it."""
    rest = reached.nearest(0.0, 0.0)
    if len(fitted.design) > 1:
        return [rest]
    moved = [low < high for low, high in (reached.elongation, reached.twist)]
    if sum(moved) == 1:
        lengths, twists = (np.linspace(*ends, ALONG) for ends in (reached.elongation, reached.twist))
        return [(float(length), float(twist)) for length, twist in zip(lengths, twists, strict=True)]
    stretched = [(end, rest[1]) for end in _apart(reached.elongation, rest[0])]
    return [rest, *stretched, *((rest[0], end) for end in _apart(reached.twist, rest[1]))]


def _apart(ends: Ends, rest: float) -> list[float]:
    """Those of the ends that are no more or less where the actuator rests."""
    return [end for end in ends if abs(end - rest) > APART * (ends[1] - ends[0])]
