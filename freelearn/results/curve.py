"""What a model predicts along the pressure steps of one kinematic state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import torch

from freelearn.answer.bands import Bands
from freelearn.measurements.members import pressure_column
from freelearn.measurements.states import States
from freelearn.measurements.usable import SLACK, usable_rows
from freelearn.models.base import Model
from freelearn.models.prediction import Status
from freelearn.results.curve_bands import band_ends
from freelearn.results.sweep import moving_actuators
from freelearn.units import KPA

POINTS = 60


# A kinematic state's measured rows, and each model's curve there by the model's name.
StateCurves = tuple[pd.DataFrame, dict[str, pd.DataFrame]]


def state_curves(
    models: Mapping[str, Model[Any]],
    table: pd.DataFrame,
    picked: Sequence[np.ndarray],
    states: States | None = None,
    bands: Mapping[str, Bands | None] | None = None,
) -> list[StateCurves]:
    """Rows and curves of each picked state. picked: positions in `table` of a state's rows, in time order.

    states: those of the table's rows, where the table alone does not tell what they remember; some effects remember
    what the sample went through before. bands: how far a new measurement may lie from a model's curve, by the model's
    name.
    """
    states = States.from_table(table) if states is None else states
    usable, taut, bands = usable_rows(table), taut_rows(table), bands or {}

    def curves(rows: np.ndarray) -> dict[str, pd.DataFrame]:
        there, both = states[torch.as_tensor(rows)], (usable[rows], taut[rows])
        return {name: model_curve(model, there, *both, bands.get(name)) for name, model in models.items()}

    return [(table.iloc[rows], curves(rows)) for rows in picked]


def taut_rows(table: pd.DataFrame) -> np.ndarray:
    """Usable rows in which no tube hangs loose, (N,) bool."""
    usable = usable_rows(table)
    taut: np.ndarray = usable & (table[SLACK].to_numpy(np.float64) != 1) if SLACK in table else usable
    return taut


def model_curve(
    model: Model[Any], states: States, usable: np.ndarray, taut: np.ndarray, bands: Bands | None = None
) -> pd.DataFrame:
    """What is predicted along the path that the pressures took: from zero to the first step, then from step to step. Of
    several actuators those begin at zero that move.

    states: one kinematic state's rows in time order; usable, taut: (N,) bool of them, see taut_rows. Points between two
    steps remember what the later one does (its direction, its times), so that rising and falling pressure draw two
    branches.
    Columns, in the order of the path: the pressures, what the bed measures (force_pred_n, moment_pred_nmm; blank
    without an equilibrium), with bands the ends of each one's band (force_pred_n_low, force_pred_n_high; blank where
    nothing tells it, see curve_bands.band_ends), extrapolated (outside the pressures of usable rows).
    """
    first, second, *imposed = (value.numpy() for value in states.inputs())
    pressure = np.stack(imposed)
    held = ~moving_actuators(pressure.T) & bool(states.members)
    before = np.c_[np.where(held, pressure[:, 0], 0.0), pressure[:, :-1]]
    # As dense on a long way as on a short one: else the way up and the way down would seem to differ.
    way = np.abs(pressure - before).max(axis=0)
    count = np.maximum(1, np.round(POINTS * way / max(way.sum(), 1.0))).astype(np.int64)
    step = np.repeat(np.arange(len(states)), count)
    share = np.concatenate([np.arange(1, n + 1) / n for n in count])
    along = np.c_[before[:, 0], before[:, step] + share * (pressure - before)[:, step]]
    rows = np.r_[0, step]
    path = states[torch.as_tensor(rows)].with_inputs(
        [torch.as_tensor(value) for value in (first[rows], second[rows], *along)]
    )
    with torch.no_grad():
        shown, status = model(path)
    shown[status == Status.NO_EQUILIBRIUM] = torch.nan
    outside = _outside(along, pressure[:, usable] if usable.any() else pressure)
    each = {pressure_column(i): value / KPA for i, value in enumerate(along, 1)} if states.members else {}
    bed = states.bed
    predicted = {q.predicted: shown[:, i].numpy() / q.factor for i, q in enumerate(bed.readings) if q in bed.measured}
    if bands is not None:
        # A tube that hangs loose shows another load than the push that is predicted.
        within = ~_outside(along, pressure[:, taut]) & (status == Status.OK).numpy()
        predicted |= band_ends(bands, path, shown, within)
    return pd.DataFrame({"pressure_kpa": path.pressure.numpy() / KPA, **each, **predicted, "extrapolated": outside})


def _outside(along: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Which points of a path (actuators, N) lie beyond some rows' pressures (actuators, n), (N,) bool."""
    if not pressure.size:
        return np.ones(along.shape[1], dtype=bool)
    rounding = 1e-9 * np.abs(pressure).max()
    beyond = (along < pressure.min(1, keepdims=True) - rounding) | (along > pressure.max(1, keepdims=True) + rounding)
    outside: np.ndarray = beyond.any(0)
    return outside
