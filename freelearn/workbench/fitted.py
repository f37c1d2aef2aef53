"""A finished run as the page compares it with the measurements."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from freelearn.measurements.beds import PRESSURE, Quantity, bed_of
from freelearn.measurements.states import States, kinematic_state
from freelearn.measurements.usable import usable_rows
from freelearn.models.base import Model
from freelearn.models.build import load_model
from freelearn.models.predicted import usable
from freelearn.results.curve import model_curve
from freelearn.results.quantities import misses, moving, plane, pressures, swept, told
from freelearn.results.residuals import residual_table
from freelearn.results.states import ROWS_FOR_A_CURVE, fields, place_text, places

# Pressures of an actuator that is held lie nearer to each other than this share of all that actuators go through.
APART = 0.03
# An actuator whose pressure wanders by less than this share of the moving one's way is held.
HELD = 0.1


class Fitted:
    """A finished run's rows, states and model.

    curve: number of each row's curve, (N,): its kinematic state, or, where the actuators of an end block move one by
    one, what of it has the others held. place: of each curve, its sample and what the bed imposes, by its number.
    over: the two quantities of the map; map: its fields; field: number of each row's field, (N,)."""

    def __init__(self, folder: Path) -> None:
        self.model: Model = load_model(folder / "checkpoint.ckpt")
        self.table = pd.read_csv(folder / "predictions.csv")
        self.states = States.from_table(self.table)
        self.usable = usable_rows(self.table)
        state = kinematic_state(self.table)
        self.curve = curves_of(self.table, state)
        first = np.unique(self.curve, return_index=True)[1]
        self.place = places(self.table).iloc[state[first]].set_index(np.arange(len(first)))
        self.bed, self.told = bed_of(self.table), told(self.table)
        self.missed = misses(usable(self.table))
        # Of a bed that held an elongation or a twist throughout, the map shows the pressure in its place.
        self.over = plane(self.table)
        self.map = residual_table(self.table, self.over)
        self.field = fields(self.table, self.over)[0]

    def rows(self, curve: int) -> np.ndarray:
        """Positions of a curve's rows, in time order."""
        return np.flatnonzero(self.curve == curve)

    def told_of(self, sample: int) -> tuple[Quantity, ...]:
        """What was measured of a sample."""
        return told(self.table[self.table["sample"] == sample]) or self.told

    def labels(self, sample: int) -> dict[int, str]:
        """The sample's curves that have usable rows, by their place, and what each is called."""
        used = np.isin(np.arange(len(self.place)), self.curve[self.usable])
        order = [quantity.column for quantity in self.bed.state]
        shown = self.place[(self.place["sample"] == sample) & used].sort_values(order, kind="stable")
        return {int(n): self._label(int(n), place) for n, place in shown.iterrows()}

    def _label(self, curve: int, place: pd.Series) -> str:
        parts = [place_text(place, self.bed.state), _moved(self.table.iloc[self.rows(curve)])]
        return ", ".join(part for part in parts if part).replace("-", "−")

    def worst(self, curves: list[int]) -> int:
        """That of these curves on which the model errs most, on average over its rows."""
        curve = self.curve[self.missed.index]
        each = self.missed.groupby(curve)
        rows = each.size().reindex(curves, fill_value=0)
        enough = rows.index[rows >= min(ROWS_FOR_A_CURVE, rows.max())]
        size = (each.mean().abs() / self.missed.abs().max().replace(0.0, 1.0)).sum(axis=1)
        return int(size.reindex(enough).fillna(0.0).idxmax())

    def predicted(self, rows: np.ndarray) -> pd.DataFrame:
        """What the model predicts along the pressures of these rows (see results.curve.model_curve)."""
        curve = model_curve(self.model, self.states[torch.as_tensor(rows)], self.usable[rows])
        # An end block's actuators begin at no common rest, from which a curve could be drawn.
        return curve[~curve["extrapolated"]] if self.states.members else curve


@lru_cache(8)
def fitted(folder: Path, written: float) -> Fitted:
    """written: when the run was, so that a newer one in the same folder is read anew."""
    return Fitted(folder)


def curves_of(table: pd.DataFrame, state: np.ndarray) -> np.ndarray:
    """Number of each row's curve, (N,), 0, 1, … in order of the states. state: of each row, (N,).

    A line through rows in which several actuators of an end block change in turn would zigzag: there a curve has
    those rows of its state in which all but the one that changes most are held."""
    several = pressures(table)
    if len(several) == 1:
        return state
    pressure = table[[q.column for q in several]].to_numpy(dtype=np.float64)
    apart = APART * np.ptp(pressure)
    keys = np.c_[state, np.apply_along_axis(_levels, 0, pressure, apart)]
    for n in np.unique(state):
        rows = state == n
        moved = swept(table[rows]).column
        # All of them, where they change together.
        free = [i for i, q in enumerate(several, 1) if moved in (q.column, PRESSURE.column)]
        keys[np.ix_(rows, free)] = 0
    number: np.ndarray = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    return number


def _moved(rows: pd.DataFrame) -> str:
    """Which actuator of an end block moves along a curve, and what the others hold; "" for a single actuator."""
    over = swept(rows)
    held = [q for q in pressures(rows) if q.column != over.column]
    if not held or any(np.ptp(rows[q.column]) > HELD * np.ptp(rows[over.column]) for q in held):
        return moving(rows)
    return ", ".join([over.symbol, *(f"{q.symbol} at {rows[q.column].mean():.3g} kPa" for q in held)])


def _levels(pressure: np.ndarray, apart: float) -> np.ndarray:
    """Number of the level that each pressure is at, (N,), of levels more than `apart` from each other."""
    order = np.argsort(pressure)
    steps = np.diff(pressure[order]) > apart
    level = np.zeros(len(pressure), dtype=np.int64)
    level[order[1:]] = np.cumsum(steps)
    return level
