"""What pressures reach, in a plane of loads or of poses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.beds import ELONGATION, Pair, Quantity
from freelearn.physics.chain.prediction import Prediction, Status
from freelearn.queries.maps.map_scope import OperatingRange

# The convex hull of points in a plane.

# Corners that stick out by less than this share of the points' extent are none: rounding makes them.
FLAT = 1e-9


def hull(points: np.ndarray) -> np.ndarray:
    """Positions of the hull's vertices, counterclockwise from the leftmost: Andrew's monotone chain, which also takes
    points on one line, where there are two, and a single point. points: (N, 2), finite.

    >>> hull(np.array([[0.0, 0], [2, 0], [1, 0], [2, 2], [0, 2], [1, 1]])).tolist()
    [0, 1, 3, 4]
    >>> hull(np.array([[0.0, 0], [1, 1], [2, 2]])).tolist()
    [0, 2]
    """
    extent = np.ptp(points, axis=0)
    scaled = points / np.where(extent > 0, extent, 1.0)
    order = [int(i) for i in np.lexsort((scaled[:, 1], scaled[:, 0]))]
    lower, upper = _chain(scaled, order), _chain(scaled, order[::-1])
    # Each ends where the other begins.
    return np.array(lower[:-1] + upper[:-1] if len(lower) > 1 else lower, dtype=np.int64)


def _chain(points: np.ndarray, order: list[int]) -> list[int]:
    """The points that have none on their right, on the way from the first to the last."""
    kept: list[int] = []
    for here in order:
        if kept and np.abs(points[here] - points[kept[-1]]).max() <= FLAT:
            continue
        while len(kept) > 1 and _turn(points, kept[-2], kept[-1], here) <= FLAT:
            kept.pop()
        kept.append(here)
    return kept


def _turn(points: np.ndarray, first: int, second: int, third: int) -> float:
    """Twice the area of a triangle: positive where it turns to the left."""
    (ax, ay), (bx, by) = points[second] - points[first], points[third] - points[first]
    return float(ax * by - ay * bx)


# Pressures within reach, those of several actuators in every combination.

# Levels of a single actuator, of each of two, three, …; of more, so many that all combinations are about MOST.
LEVELS = (61, 25, 13)
MOST = 4096


@dataclass(frozen=True)
class PressureGrid:
    """quantities: the pressure of each of k actuators. levels: (k, n) kPa, rising; a row for each actuator."""

    quantities: tuple[Quantity, ...]
    levels: np.ndarray

    @classmethod
    def between(cls, quantities: tuple[Quantity, ...], low: np.ndarray, high: np.ndarray) -> PressureGrid:
        """Even levels between the ends (k,) kPa of each. Raises UserError for more actuators than can be combined."""
        count = len(quantities)
        if 2**count > MOST:
            raise UserError(f"{count} actuators have too many combinations of pressures for a map.")
        levels = LEVELS[count - 1] if count <= len(LEVELS) else max(2, int(MOST ** (1 / count) + 1e-9))
        return cls(quantities, np.linspace(low, high, levels, axis=1))

    @property
    def points(self) -> np.ndarray:
        """Every combination, (n^k, k) kPa; the last actuator's pressure changes first."""
        return np.stack([axis.ravel() for axis in np.meshgrid(*self.levels, indexing="ij")], axis=1)

    @property
    def highest(self) -> np.ndarray:
        """The combinations of lowest and highest pressures, as numbers whose bit m says that actuator m is at its
        highest; −1 for a point with any other pressure: (n^k,) int64."""
        count, levels = self.levels.shape
        place = np.stack(np.unravel_index(np.arange(levels**count), (levels,) * count), axis=1)
        low, high = place == 0, place == levels - 1
        corner: np.ndarray = np.where((low | high).all(1), high @ (1 << np.arange(count)), -1)
        return corner

    @property
    def cells(self) -> np.ndarray:
        """Positions of the four corners, in turn, of every square in which two pressures go from level to level and the
        others stay: (Q, 4) int64. Their images cover all that the actuators reach; one actuator has none."""
        count, levels = self.levels.shape
        number = np.arange(levels**count).reshape((levels,) * count)
        parts = [np.empty((0, 4), dtype=np.int64)]
        for pair in combinations(range(count), 2):
            front = np.moveaxis(number, pair, (0, 1))
            corners = [front[:-1, :-1], front[1:, :-1], front[1:, 1:], front[:-1, 1:]]
            parts.append(np.stack([corner.ravel() for corner in corners], axis=1))
        return np.concatenate(parts)

    def name(self, corner: int) -> str:
        """A combination's actuators at their highest pressure, by number: "1+3"; "none" where all are at their lowest,
        "" for −1 and of a single actuator."""
        if corner < 0 or len(self.quantities) == 1:
            return ""
        inflated = [quantity.symbol.removeprefix("P") for m, quantity in enumerate(self.quantities) if corner >> m & 1]
        return "+".join(inflated) or "none"


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
    reached: OperatingRange
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
