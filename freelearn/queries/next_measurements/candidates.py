"""The rows that a plan may choose from, how the pressure may go at one place, and in which order visits are made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
import torch

from freelearn.data.beds import bed_of
from freelearn.data.columns import Columns
from freelearn.data.states import SECONDS_PER_ROW, States
from freelearn.discovery.search.next_states import PRESSURES, reach
from freelearn.queries.next_measurements.goals import Contrast, Goal
from freelearn.queries.next_measurements.known_rows import Known, standing
from freelearn.queries.next_measurements.views import InformationMatrix, Objective, Visits

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
        both = bool((self.direction == -1).any())
        size = limit if levels <= (MANY_BOTH if both else MANY) else min(limit, FEW)
        every = (c for n in range(1, size + 1) for c in combinations(range(levels), n))
        chosen = _visits(levels, size) if both else list(every)
        if size < levels <= limit:
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


# The rows that a plan may choose from: places and pressures within the bed's reach.

# Significant digits of a place, as a share of what the bed spans.
DIGITS = 2
# An end of the reach is a round number to within this share of its last digit.
ROUNDING = 1e-6
# A lowest pressure within this share of the highest is zero as the gauge read it.
GAUGE = 0.02
# How the pressure got there counts where rows differ by more than this share; some places are looked at for that.
SAME, LOOKED_AT = 1e-9, 8

Limits = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Candidates:
    """table: the rows, in the measurement table's columns, L of every place one after the other, as its Path has them.
    objective: of all visits to those places."""

    table: pd.DataFrame
    objective: Objective

    def rows_of(self, visit: int) -> pd.DataFrame:
        """What a visit reads, its steps counted."""
        place, rows = self.objective.visits.rows_of(visit)
        part = self.table.iloc[place * self.objective.visits.shared.shape[1] + rows]
        return part.assign(step=np.arange(len(part)))


def candidates(
    known: Known, goal: Goal, limits: Limits | None = None, per_state: int | None = None, levels: int = PRESSURES
) -> Candidates:
    """Everything that the bed can reach. per_state: most rows of a visit. levels: pressures of each place at least."""
    levels = max(PRESSURES, levels)
    rising = rounded(reach(known.table, levels, limits), limits)
    some = np.unique(np.linspace(0, len(rising) // levels - 1, LOOKED_AT).astype(np.int64))
    few = rising.iloc[(some[:, None] * levels + np.arange(levels)).reshape(-1)]
    both, path = Path.both(levels), Path.rising(levels)
    if not _same(_looked(known, goal, few, levels, both), both):
        # Going up and down again a place is read twice at nearly every level.
        levels = max(PRESSURES, levels // 2 + 1)
        path, rising = Path.both(levels), rounded(reach(known.table, levels, limits), limits)
    looked = _looked(known, goal, rising, levels, path)
    visits = Visits(looked.shared, looked.usable, path.subsets(per_state))
    views = [
        InformationMatrix.scaled(t.name, c, t.known, t.interest)
        for t, c in zip(looked.contrasts, looked.columns, strict=True)
    ]
    return Candidates(looked.table, Objective(visits, views))


@dataclass(frozen=True)
class _Looked:
    """Rows of whole paths: what they tell, and how noisily, by place and row of the path."""

    table: pd.DataFrame
    contrasts: list[Contrast]
    columns: list[np.ndarray]
    shared: np.ndarray
    usable: np.ndarray


def _looked(known: Known, goal: Goal, rising: pd.DataFrame, levels: int, path: Path) -> _Looked:
    starts = np.arange(0, len(rising), levels)
    table = rising.iloc[(starts[:, None] + path.level).reshape(-1)].reset_index(drop=True)
    states = standing(path.directed(States.from_table(table)), known.rows.states)
    contrasts, answered = goal.contrasts(known, states)
    whiten = known.noise(states, torch.arange(len(states)))
    shape = (len(starts), len(path.level))
    columns = [whiten.apart(t.columns).numpy().reshape(*shape, 2, t.columns.shape[-1]) for t in contrasts]
    return _Looked(
        table, contrasts, columns, whiten.shared.numpy().reshape(*shape, 2, 2), answered.numpy().reshape(shape)
    )


def _same(looked: _Looked, path: Path) -> bool:
    """Whether rows of a level say the same however the pressure got there."""
    for columns in looked.columns:
        size = np.abs(columns).max(initial=0.0, axis=(0, 1, 2))
        for level in np.unique(path.level):
            own = columns[:, path.level == level]
            if (np.abs(own - own[:, :1]).max(initial=0.0, axis=(0, 1, 2)) > SAME * size).any():
                return False
    return True


def digits(low: float, high: float) -> int:
    """Digits behind the point that tell places apart between two ends.

    >>> digits(-5.0, 5.0), digits(0.0, 72.5)
    (1, 1)
    """
    return DIGITS - int(np.floor(np.log10(high - low)))


def rounded(table: pd.DataFrame, limits: Limits | None) -> pd.DataFrame:
    """Numbers that a person can set, still within reach."""
    table = table.copy()
    columns = Columns.from_table(table)
    for name in columns.imposed:
        low, high = float(table[name].min()), float(table[name].max())
        if name in columns.pressures and name not in (limits or {}) and abs(low) < GAUGE * high:
            table[name] = table[name].clip(lower=0.0)
        if high > low:
            step = 10.0 ** -digits(low, high)
            inside = np.ceil(low / step - ROUNDING) * step, np.floor(high / step + ROUNDING) * step
            table[name] = table[name].clip(*inside).round(digits(low, high))
    if len(columns.pressures) > 1:
        table["pressure_kpa"] = table[list(columns.pressures)].mean(axis=1)
    return table


# A place that is visited once more lies beside itself by this share of what tells places apart: far less than the bed
# errs, but a table then has no two equal lines.
BESIDE = 0.1


def by_sample(rows_of: Callable[[int], pd.DataFrame], visits: np.ndarray, seed: int) -> list[pd.DataFrame]:
    """The rows of each of some visits, sample by sample, those of a sample at random."""
    drawn = np.random.default_rng([seed, 307]).permutation(visits)
    return sorted((rows_of(int(visit)) for visit in drawn), key=lambda part: int(part["sample"].iloc[0]))


def ordered(there: Candidates, visits: np.ndarray, measured: pd.DataFrame, seed: int) -> pd.DataFrame:
    """The rows of some visits, sample by sample, mountings of each at random: sorted ones would look like a drift.

    measured: rows that there are already."""
    parts = by_sample(there.rows_of, visits, seed)
    imposed = [quantity.column for quantity in bed_of(there.table).state]
    name = imposed[0]
    low, high = float(there.table[name].min()), float(there.table[name].max())
    step = BESIDE * 10.0 ** -digits(low, high) if high > low else 0.0
    been = set(measured[["sample", *imposed]].itertuples(index=False, name=None))
    out = []
    for part in parts:
        sample, first, second = part[["sample", *imposed]].iloc[0]
        inward = -1.0 if first > (low + high) / 2 else 1.0
        while step and (sample, first, second) in been:
            first = round(first + inward * step, 12)
        been.add((sample, first, second))
        out.append(part.assign(**{name: first}))
    return pd.concat(out, ignore_index=True)
