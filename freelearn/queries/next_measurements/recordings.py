"""The recordings that a plan may choose from where rows are samples of a log: places, and how what is driven goes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import pandas as pd
import torch

from freelearn.data.beds import bed_of
from freelearn.data.columns import Columns
from freelearn.data.logs import RUN, TIME, run_numbers
from freelearn.data.states import States
from freelearn.queries.next_measurements.candidates import GAUGE, Limits, by_sample, rounded
from freelearn.queries.next_measurements.courses import Course, courses
from freelearn.queries.next_measurements.goals import Goal
from freelearn.queries.next_measurements.known_rows import Known, standing
from freelearn.queries.next_measurements.views import InformationMatrix, Objective, Visits

# The shortest recording that a table may have.
FEWEST = 8
# Places along each of the two quantities of a state, fewer where recordings are long; and rows that are looked at.
GRIDS, LOOKED_AT = (3, 2, 1), 150_000
# Where a length or a twist is driven itself, the pressures that it is driven at, as shares of their range.
PRESSURES = (0.0, 0.5, 1.0)
# A length or a twist is driven where in some recording it went through this share of its range.
DRIVEN = 0.2
# How fast a bed may drive something, and how long it waits between rows, in `reach`.
PER_SECOND, INTERVAL = "_per_s", "interval_s"


class Courses(Visits):
    """Candidates of which each is one whole recording: it counts as one, however many rows it has."""

    @cached_property
    def sizes(self) -> np.ndarray:
        """One, (1,)."""
        return np.ones(1, dtype=np.int64)


@dataclass(frozen=True)
class Recordings:
    """table: the rows of every candidate, one after the other, in the measurement table's columns. objective: of all
    candidates, each a recording of `count` rows."""

    table: pd.DataFrame
    objective: Objective
    count: int

    def rows_of(self, number: int) -> pd.DataFrame:
        """What a candidate reads."""
        return self.table.iloc[number * self.count : (number + 1) * self.count]


def usual_rows(table: pd.DataFrame) -> int:
    """How many rows a recording of a log has, usually."""
    return int(np.median(np.unique(run_numbers(table), return_counts=True)[1]))


def usual_interval(table: pd.DataFrame) -> float:
    """Time between two rows of a log, usually [s]."""
    return float(np.median(_steps(table, TIME)))


def recordings(
    known: Known, goal: Goal, count: int, limits: Limits | None = None, looked_at: int = LOOKED_AT
) -> Recordings:
    """All that the bed can go through in a recording of `count` rows. looked_at: rows of all candidates, about."""
    table = paths(known.table, count, limits or {}, looked_at)
    number = np.repeat(np.arange(len(table) // count), count)
    states = _alone(table, number, known.rows.states)
    contrasts, answered = goal.contrasts(known, states)
    whiten = known.noise(states, torch.as_tensor(number))
    shape = (len(table) // count, count)
    views = []
    for contrast in contrasts:
        heard = torch.where(answered[:, None, None], contrast.columns, 0.0)
        columns = whiten(heard).numpy().reshape(*shape, 2, heard.shape[-1])
        views.append(InformationMatrix.scaled(contrast.name, columns, contrast.known, contrast.interest))
    # What a recording's rows share is in the whitened columns.
    apart = np.zeros((*shape, 2, 2))
    visits = Courses(apart, answered.numpy().reshape(shape), np.ones((1, count), dtype=bool))
    return Recordings(table, Objective(visits, views), count)


def _alone(table: pd.DataFrame, number: np.ndarray, known: States) -> States:
    """The rows of every candidate as if it were the next recording of its actuator."""
    sample = torch.tensor(table["sample"].to_numpy(np.int64))
    states = States.from_table(table.assign(sample=number)).replace(sample=sample)
    assert states.recording is not None
    recording = states.recording.with_states(states.recording.states.replace(sample=sample))
    return standing(states.replace(recording=recording), known)


# What is imposed.


def paths(measured: pd.DataFrame, count: int, limits: Limits, looked_at: int) -> pd.DataFrame:
    """The rows of every candidate, one after the other, in the measurement table's columns."""
    span = _spans(measured, limits)
    columns = Columns.from_table(measured)
    state = [quantity.column for quantity in bed_of(measured).state]
    drives = [
        (interval, names, course)
        for interval in _intervals(measured, limits)
        for names, course in _drives(measured, count, interval, span, limits)
    ]
    parts: list[pd.DataFrame] = []
    for grid in GRIDS:
        parts = [
            _path(own.iloc[:1], dict(zip(columns.imposed, at, strict=True)), moved, count, interval)
            for _, own in measured.groupby("sample", sort=True)
            for interval, names, course in drives
            for moved in [{name: _driven(span[name], course, count) for name in names}]
            for at in _places(span, state, columns.pressures, names, grid)
        ]
        if len(parts) * count <= looked_at:
            break
    runs = np.repeat(np.arange(1, len(parts) + 1), count)
    return rounded(pd.concat(parts, ignore_index=True).assign(**{RUN: runs}), limits)


# What is driven together, and how.
Drive = tuple[tuple[str, ...], Course]


def _driven(span: tuple[float, float], course: Course, count: int) -> np.ndarray:
    low, high = span
    return low + (high - low) * course.along(count)


def _path(
    first: pd.DataFrame, at: dict[str, float], moved: dict[str, np.ndarray], count: int, interval: float
) -> pd.DataFrame:
    """One candidate: everything at its place, but for what is driven."""
    row = np.arange(count)
    part = first.iloc[np.zeros(count, dtype=np.int64)].reset_index(drop=True)
    return part.assign(**at).assign(**moved, step=row, **{TIME: np.round(row * interval, 9)})


def _spans(measured: pd.DataFrame, limits: Limits) -> dict[str, tuple[float, float]]:
    """Lowest and highest of everything imposed. A pressure that is zero as the gauge read it is zero."""
    columns = Columns.from_table(measured)
    spans = {name: (float(measured[name].min()), float(measured[name].max())) for name in columns.imposed}
    for name in columns.pressures:
        low, high = spans[name]
        spans[name] = (0.0 if abs(low) < GAUGE * high else low), high
    return spans | {name: limits[name] for name in spans if name in limits}


def _intervals(measured: pd.DataFrame, limits: Limits) -> list[float]:
    """Times between rows: as they were, or from the shortest to the longest that the user allows."""
    if INTERVAL in limits:
        return list(dict.fromkeys(np.geomspace(*limits[INTERVAL], 3).tolist()))
    return [usual_interval(measured)]


def _steps(measured: pd.DataFrame, name: str) -> np.ndarray:
    """Changes of a column from row to row of a recording."""
    run = run_numbers(measured)
    change = np.diff(measured[name].to_numpy(np.float64))
    return np.asarray(change[run[1:] == run[:-1]])


def _drives(
    measured: pd.DataFrame, count: int, interval: float, span: dict[str, tuple[float, float]], limits: Limits
) -> list[Drive]:
    """What may be driven, and along which course: each pressure alone, all together, and a length or twist that was
    driven before."""
    columns = Columns.from_table(measured)
    alone = [(name,) for name in columns.pressures] if len(columns.pressures) > 1 else []
    driven = [*alone, columns.pressures]
    state = [q.column for q in bed_of(measured).state]
    driven += [(name,) for name in state if name + PER_SECOND in limits or _moved(measured, name)]
    out = list[Drive]()
    for names in driven:
        fastest = min(_rate(measured, name, limits) for name in names)
        width = max(high - low for low, high in (span[name] for name in names))
        if width > 0 and fastest > 0:
            out += [(names, course) for course in courses(count, width / fastest / interval)]
    return out


def _rate(measured: pd.DataFrame, name: str, limits: Limits) -> float:
    """How fast the bed drove a column, in its unit a second, or can."""
    if name + PER_SECOND in limits:
        return limits[name + PER_SECOND][1]
    return float(np.abs(_steps(measured, name) / _steps(measured, TIME)).max(initial=0.0))


def _moved(measured: pd.DataFrame, name: str) -> bool:
    """Whether a recording went through a good part of what the bed spans."""
    ends = measured[name].groupby(run_numbers(measured)).quantile([0.05, 0.95]).unstack()
    return bool((ends[0.95] - ends[0.05]).max() > DRIVEN * np.ptp(measured[name]))


def _places(
    span: dict[str, tuple[float, float]],
    state: Sequence[str],
    pressures: Sequence[str],
    driven: Sequence[str],
    grid: int,
) -> list[tuple[float, ...]]:
    """Where all that is not driven stands: of the state's quantities on a grid, the pressures lowest, or where a length
    or a twist is driven at several levels."""
    shares = np.linspace(0, 1, grid) if grid > 1 else [0.5]
    axes = [[0.0] if name in driven else shares for name in state]
    levels = [0.0] if set(driven) <= set(pressures) else PRESSURES

    def at(name: str, share: float) -> float:
        low, high = span[name]
        return low + share * (high - low)

    found = {
        (*(at(name, share) for name, share in zip(state, place, strict=True)), *(at(name, level) for name in pressures))
        for place, level in product(product(*axes), levels)
    }
    return sorted(found)


def in_order(there: Recordings, chosen: np.ndarray, measured: pd.DataFrame, seed: int) -> pd.DataFrame:
    """The rows of some candidates, actuator by actuator, recordings of each at random, their runs counted on from those
    that are measured."""
    parts = by_sample(there.rows_of, chosen, seed)
    taken = pd.to_numeric(measured[RUN], errors="coerce").max()
    begun = 0 if np.isnan(taken) else int(taken)
    return pd.concat(
        [part.assign(**{RUN: begun + number}) for number, part in enumerate(parts, start=1)], ignore_index=True
    )
