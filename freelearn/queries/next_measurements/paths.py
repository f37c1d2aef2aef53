"""How the pressure may go at one place: up, and down again where that tells anything."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import torch

from freelearn.data.states import SECONDS_PER_ROW, States

# Levels beyond which only visits of a few rows are looked at, and all levels at once: every set of them would be
# thousands a place. Where it counts how the pressure got there, there are more sets.
MANY, MANY_BOTH, FEW = 10, 5, 3


@dataclass(frozen=True)
class Path:
    """The rows of a place: at which level of pressure, (L,), and whether the pressure rose (+1), fell (−1) or was the
    first (0) to get there."""

    level: np.ndarray
    direction: np.ndarray

    @classmethod
    def rising(cls, levels: int) -> Path:
        """Each level once: which way the pressure went tells nothing."""
        return cls(np.arange(levels), np.where(np.arange(levels) == 0, 0, 1))

    @classmethod
    def both(cls, levels: int) -> Path:
        """Each level as the first of a visit, as one that was risen to, and as one that was fallen to."""
        up, first = np.arange(1, levels), np.arange(levels)
        level = np.concatenate([first, up, up[::-1] - 1])
        return cls(level, np.repeat([0, 1, -1], [levels, levels - 1, levels - 1]))

    def subsets(self, most: int | None) -> np.ndarray:
        """The sets of rows that one visit can read, at most `most`: (S, L) bool. With directions, a first row, then
        higher ones, then some that are lower than the highest."""
        levels = int(self.level.max()) + 1
        limit = most or len(self.level)
        if (self.direction == -1).any():
            sizes = range(1, (limit if levels <= MANY_BOTH else min(limit, FEW)) + 1)
            chosen = _visits(levels, sizes[-1])
        else:
            sizes = range(1, (limit if levels <= MANY else min(limit, FEW)) + 1)
            chosen = [c for n in sizes for c in combinations(range(levels), n)]
        if levels <= limit and levels > sizes[-1]:
            chosen.append(tuple(np.flatnonzero(self.whole())))
        subsets = np.zeros((len(chosen), len(self.level)), dtype=bool)
        for number, members in enumerate(chosen):
            subsets[number, list(members)] = True
        return subsets

    def whole(self) -> np.ndarray:
        """Every level once, rising, (L,) bool."""
        return np.asarray((self.direction > 0) | ((self.direction == 0) & (self.level == 0)))

    def directed(self, states: States) -> States:
        """States of whole paths, with their directions and the time since each place was come to."""
        since = np.where(
            self.direction == 0, 0, np.where(self.direction > 0, self.level, 2 * self.level.max() - self.level)
        )
        dwell = torch.as_tensor(np.tile(SECONDS_PER_ROW * since, len(states) // len(since)))

        def with_direction(part: States) -> States:
            pressure = part.pressure.reshape(-1, len(since))
            # Of several actuators some are not inflated.
            changes = (pressure != pressure[:, :1]).any(1, keepdim=True)
            direction = torch.as_tensor(self.direction, dtype=torch.float64) * changes
            return part.replace(direction=direction.reshape(-1), dwell=dwell)

        return with_direction(states).replace(members=tuple(map(with_direction, states.members)))


def _visits(levels: int, most: int) -> list[tuple[int, ...]]:
    """At most so many rows of Path.both that go together: a first one, those risen to above it, those fallen to below
    the highest."""
    out = []
    for size in range(1, min(levels, most) + 1):
        for up in combinations(range(levels), size):
            rising = (up[0], *(levels + level - 1 for level in up[1:]))
            # Of what is fallen to the highest level stands first.
            fallen = range(2 * levels - 1 + levels - 1 - up[-1], 3 * levels - 2)
            for fewer in range(min(len(fallen), most - size) + 1):
                out += [(*rising, *down) for down in combinations(fallen, fewer)]
    return out
