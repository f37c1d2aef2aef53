"""What a model predicts along the pressure steps of one kinematic state, with its 95 % bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.data.beds import KPA
from freelearn.data.columns import SLACK, pressure_column, usable_rows
from freelearn.data.states import States
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import Status
from freelearn.queries.curves.curve_rows import moving_actuators
from freelearn.queries.inverse.bands import Bands

# The 95 % bands beside a model's curves: their ends as numbers, and the areas that pictures fill.

# What the bands are called in legends with room, and in narrow ones.
BAND, SHORT = "95 % band for a new measurement", "95 % band"


def ends(column: str) -> tuple[str, str]:
    """The columns of the lower and of the upper end of a quantity's band.

    >>> ends("force_pred_n")
    ('force_pred_n_low', 'force_pred_n_high')
    """
    return f"{column}_low", f"{column}_high"


def band_ends(bands: Bands, path: States, shown: Tensor, within: np.ndarray) -> dict[str, np.ndarray]:
    """Both ends of the band of each quantity that the bed measures, (N,) each in the table's units, by their columns;
    NaN where nothing tells them.

    shown: (N, 2) SI, what the model says at each point of a path; within: (N,) bool, the points whose pressures were
    measured. How far a model misses is told by rows like those that it was compared with: neither beyond the measured
    pressures nor of an actuator of which no row was compared does anything tell it."""
    half = np.full(shown.shape, np.nan)
    told = torch.isin(path.sample, bands.miss.held.system.states.sample.unique()).numpy()
    rows = np.flatnonzero(within & told & shown.isfinite().all(-1).numpy())
    if len(rows):
        place = torch.as_tensor(rows)
        half[rows] = bands.half(path[place], shown[place])
    columns: dict[str, np.ndarray] = {}
    for i, quantity in enumerate(path.bed.readings):
        if quantity in path.bed.measured:
            pair = shown[:, i].numpy() - half[:, i], shown[:, i].numpy() + half[:, i]
            columns |= {name: end / quantity.factor for name, end in zip(ends(quantity.predicted), pair, strict=True)}
    return columns


def has_band(curve: pd.DataFrame, column: str) -> bool:
    """Whether a curve's frame says of any point how far a new measurement of this quantity may lie."""
    low, _ = ends(column)
    return low in curve and bool(curve[low].notna().any())


def strip(curve: pd.DataFrame, across: str, up: str) -> np.ndarray:
    """What a picture fills to show a band: x, one end and the other, (M, 3), to be run along by the one end and back by
    the other; blanks are bridged without any width.

    The pressure rises and falls, so a band lies on itself. Where the pressure falls the ends are exchanged: so the area
    is always run around in the same sense, and a canvas fills it evenly, however often it lies on itself. curve: a
    frame of curve.model_curve; across, up: its columns."""
    if not has_band(curve, up):
        return np.empty((0, 3))
    x, low, high = (curve[name].to_numpy(dtype=np.float64) for name in (across, *ends(up)))
    there = np.isfinite(x + low + high)
    first = np.flatnonzero(there[:-1] & there[1:])
    # Of each step from point to point its beginning and its end, twice: without width, and as wide as the band.
    points = first[:, None] + [0, 0, 1, 1]
    narrow, falls = np.array([True, False, False, True]), (x[first + 1] < x[first])[:, None]
    middle = ((low + high) / 2)[points]
    one = np.where(narrow, middle, np.where(falls, high[points], low[points]))
    other = np.where(narrow, middle, np.where(falls, low[points], high[points]))
    return np.stack([x[points], one, other], axis=-1).reshape(-1, 3)


# What a model predicts along the pressure steps of one kinematic state.

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
    several actuators those begin at zero that move. Of a log, at its rows, with a blank between two recordings.

    states: one kinematic state's rows in time order; usable, taut: (N,) bool of them, see taut_rows. Points between two
    steps remember what the later one does (its direction, its times), so that rising and falling pressure draw two
    branches.
    Columns, in the order of the path: the pressures, what the bed measures (force_pred_n, moment_pred_nmm; blank
    without an equilibrium), with bands the ends of each one's band (force_pred_n_low, force_pred_n_high; blank where
    nothing tells it, see curve_bands.band_ends), extrapolated (outside the pressures of usable rows).
    """
    first, second, *imposed = (value.numpy() for value in states.inputs())
    pressure = np.stack(imposed)
    rows, along, gaps = _samples(states, pressure) if states.recording is not None else _on_the_way(states, pressure)
    path = states[torch.as_tensor(rows)].with_inputs(
        [torch.as_tensor(value) for value in (first[rows], second[rows], *along)]
    )
    with torch.no_grad():
        shown, status = model(path)
    shown[status == Status.NO_EQUILIBRIUM] = torch.nan
    shown[gaps] = torch.nan
    outside = _outside(along, pressure[:, usable] if usable.any() else pressure)
    each = {pressure_column(i): value / KPA for i, value in enumerate(along, 1)} if states.members else {}
    bed = states.bed
    predicted = {q.predicted: shown[:, i].numpy() / q.factor for i, q in enumerate(bed.readings) if q in bed.measured}
    if bands is not None:
        # A tube that hangs loose shows another load than the push that is predicted.
        within = ~_outside(along, pressure[:, taut]) & (status == Status.OK).numpy()
        predicted |= band_ends(bands, path, shown, within)
    return pd.DataFrame({"pressure_kpa": path.pressure.numpy() / KPA, **each, **predicted, "extrapolated": outside})


def _on_the_way(states: States, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of points from zero to the first of pressures (actuators, n) and on to each: the row that each belongs to, their
    pressures (actuators, N), and no gaps."""
    held = ~moving_actuators(pressure.T) & bool(states.members)
    before = np.c_[np.where(held, pressure[:, 0], 0.0), pressure[:, :-1]]
    # As dense on a long way as on a short one: else the way up and the way down would seem to differ.
    way = np.abs(pressure - before).max(axis=0)
    count = np.maximum(1, np.round(POINTS * way / max(way.sum(), 1.0))).astype(np.int64)
    step = np.repeat(np.arange(len(states)), count)
    share = np.concatenate([np.arange(1, n + 1) / n for n in count])
    along = np.c_[before[:, 0], before[:, step] + share * (pressure - before)[:, step]]
    return np.r_[0, step], along, np.zeros(0, dtype=np.int64)


def _samples(states: States, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of a log: its rows alone, since what they remember is no one's between them, and a gap before each
    recording but the first."""
    assert states.recording is not None
    run = states.recording.run[states.place].numpy()
    begins = np.flatnonzero(np.diff(run)) + 1
    rows = np.insert(np.arange(len(run)), begins, begins)
    return rows, pressure[:, rows], begins + np.arange(len(begins))


def _outside(along: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Which points of a path (actuators, N) lie beyond some rows' pressures (actuators, n), (N,) bool."""
    if not pressure.size:
        return np.ones(along.shape[1], dtype=bool)
    rounding = 1e-9 * np.abs(pressure).max()
    beyond = (along < pressure.min(1, keepdims=True) - rounding) | (along > pressure.max(1, keepdims=True) + rounding)
    outside: np.ndarray = beyond.any(0)
    return outside
