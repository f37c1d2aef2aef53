"""Pressures within reach, those of several actuators in every combination."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from freelearn.errors import UserError
from freelearn.measurements.beds import Quantity

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
