"""What pressures reach, in a plane of loads or of poses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from torch import Tensor

from freelearn.measurements.beds import ELONGATION, Pair, Quantity
from freelearn.models.prediction import Prediction, Status
from freelearn.results.hull import hull
from freelearn.results.pressure_grid import PressureGrid
from freelearn.results.reached import Reached

# Loads, or elongations and twists, below this share of what goes with the others are zero, but for rounding.
NOTHING = 1e-6


@dataclass(frozen=True)
class Case:
    """What is reached from one place, or under one load. sample, first, second: which one, in the units of the columns;
    points: its rows, those without an equilibrium too; lost: their number."""

    sample: int
    first: float
    second: float
    points: pd.DataFrame
    lost: int


@dataclass(frozen=True)
class Reachable:
    """points: sample, the two quantities imposed, each pressure, the two reached (blank without a stable equilibrium),
    status; of several actuators also `corner`, the actuators at their highest pressure where the others are at their
    lowest ("1+3"), and `vertex`, a number in turn for the vertices of the convex hull of all that is reached.

    Rows of one case (sample and what is imposed) are those of `grid.points`. imposed, plane: the quantities. reached:
    how far the run's bed went. fitted: the samples that the model was fitted on. notes: what a reader should know.
    """

    points: pd.DataFrame
    grid: PressureGrid
    imposed: Pair
    plane: Pair
    reached: Reached
    fitted: tuple[int, ...]
    notes: tuple[str, ...]

    @property
    def several(self) -> bool:
        """Whether actuators share an end block: then a region is reached, else a curve."""
        return len(self.grid.quantities) > 1

    @property
    def silent(self) -> tuple[Quantity, ...]:
        """Of the two quantities those that are zero everywhere: a braid of two like families does not turn."""
        sizes = self._sizes()
        return tuple(q for q, size in zip(self.plane, sizes, strict=True) if size <= NOTHING * max(sizes))

    @property
    def lost(self) -> int:
        """Rows without a stable equilibrium, or with loads that mean nothing."""
        return int((self.points["status"] != "ok").sum())

    def cases(self) -> Iterator[Case]:
        """Every place, or load, of every sample."""
        first, second = (quantity.column for quantity in self.imposed)
        for start in range(0, len(self.points), len(self.grid.points)):
            part = self.points.iloc[start : start + len(self.grid.points)].reset_index(drop=True)
            one = part.iloc[0]
            lost = int((part["status"] != "ok").sum())
            yield Case(int(one["sample"]), float(one[first]), float(one[second]), part, lost)

    def _sizes(self) -> list[float]:
        """Largest of either quantity, in one unit: loads as moments [N·mm] at 1 mm, poses as moves [mm] at 1 mm."""
        factor = 1.0 if self.plane[0] is not ELONGATION else np.pi / 180
        values = self.points[[q.column for q in self.plane]].abs().max().fillna(0.0).to_numpy()
        return [float(values[0]), float(values[1]) * factor]


def crossed(grid: PressureGrid, cases: pd.DataFrame) -> pd.DataFrame:
    """Every combination of pressures for each row of `cases`, one case after the other."""
    count = len(cases)
    points = {q.column: np.tile(values, count) for q, values in zip(grid.quantities, grid.points.T, strict=True)}
    return cases.loc[cases.index.repeat(len(grid.points))].reset_index(drop=True).assign(**points)


def reached_points(rows: pd.DataFrame, grid: PressureGrid, plane: Pair, found: Prediction) -> pd.DataFrame:
    """The columns of Reachable.points. rows: of `crossed`; found: the two quantities of the plane there, SI."""
    ok = (found.status == Status.OK).numpy()
    words = np.array([status.name.lower() for status in Status])[found.status.numpy()]
    values = {q.column: np.where(ok, _column(found.loads, i) / q.factor, np.nan) for i, q in enumerate(plane)}
    points = rows.assign(**values, status=words)
    if len(grid.quantities) == 1:
        return points
    corners = [grid.name(int(corner)) for corner in grid.highest]
    vertex = np.full(len(points), np.nan)
    place = points[[q.column for q in plane]].to_numpy()
    for start in range(0, len(points), len(corners)):
        there = start + np.flatnonzero(ok[start : start + len(corners)])
        if len(there):
            turn = there[hull(place[there])]
            vertex[turn] = np.arange(1, len(turn) + 1)
    return points.assign(corner=corners * (len(points) // len(corners)), vertex=pd.array(vertex, dtype="Int64"))


def _column(values: Tensor, number: int) -> np.ndarray:
    column: np.ndarray = values[:, number].numpy()
    return column
