"""Which rows of a table make up a curve, which quantities it shows, and what changes along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
import torch

from freelearn.data.beds import ELONGATION, FORCE, MOMENT, PRESSURE, Pair, Quantity, bed_of
from freelearn.data.columns import members_in, pressure_column
from freelearn.data.rows import Readings


def measured_quantities(table: pd.DataFrame) -> tuple[Quantity, ...]:
    """What the bed measures and the table has a number of."""
    return tuple(q for q in bed_of(table).measured if q.column in table and table[q.column].notna().any())


def words(quantities: Sequence[Quantity]) -> str:
    """What a heading calls them.

    >>> words((FORCE, MOMENT)), words((FORCE,))
    ('Loads', 'Force')
    """
    if tuple(quantities) == (FORCE, MOMENT):
        return "Loads"
    return " and ".join(quantity.name for quantity in quantities).capitalize()


def digits(quantity: Quantity) -> int:
    """Significant digits of a place: a bed that creeps makes more of a length meaningless."""
    return 3 if quantity is ELONGATION else 4


def pressures(table: pd.DataFrame) -> tuple[Quantity, ...]:
    """The imposed pressures: that of the actuator, or of each one on the end block."""
    return tuple(map(pressure_of, members_in(table.columns))) or (PRESSURE,)


def pressure_of(member: int) -> Quantity:
    """The pressure of one actuator on an end block."""
    return replace(PRESSURE, column=pressure_column(member), symbol=f"P{member}")


def plane(table: pd.DataFrame) -> Pair:
    """The two quantities over which a picture shows the table: the first two imposed ones that vary, and where fewer
    do, the first of the others."""
    imposed = (*bed_of(table).state, *pressures(table))
    ranked = sorted(imposed, key=lambda quantity: table[quantity.column].nunique() <= 1)
    first, second = sorted(ranked[:2], key=imposed.index)
    return first, second


def misses(rows: pd.DataFrame) -> pd.DataFrame:
    """Measured − predicted of each row, in the columns and units of what was measured; blank where nothing was, and
    zero for a push on a tube that hangs loose. rows: columns of predictions.csv, with valid predictions."""
    readings, bed = Readings.from_table(rows), bed_of(rows)
    missed = readings.missed(Readings.from_table(rows, predicted=True).value)
    shown = torch.where(readings.present, -missed, torch.nan).numpy()
    return pd.DataFrame(
        {q.column: shown[:, i] / q.factor for i, q in enumerate(bed.readings) if q in bed.measured}, index=rows.index
    )


# What changes along a curve: of the actuators on an end block those that move, and what the others hold.

# An actuator is held where its pressure wanders by less than this share of the way of the one that moves most; real
# beds regulate to some percent. Pressures nearer to each other than this are one.
HELD = 0.1
# A held pressure below this share of the largest is none.
NONE = 0.02


class Sweep(NamedTuple):
    """over: the pressure over which the curve is drawn. moved, held: which actuators do what, by their pressures."""

    over: Quantity
    moved: tuple[Quantity, ...]
    held: tuple[Quantity, ...]


def sweep(rows: pd.DataFrame) -> Sweep:
    """What changes in a curve's rows: the pressure of a single actuator; of several on one end block that of all of
    them where they change as one, else of those which change most the one that does so from row to row."""
    several = pressures(rows)
    if len(several) == 1:
        return Sweep(PRESSURE, several, ())
    values = imposed(rows)
    moves = moving_actuators(values)
    over = several[leads(values)[0]]
    if moves.all() and as_one(values):
        over = replace(PRESSURE, name="pressure of all")
    parts = [tuple(q for q, chosen in zip(several, mask, strict=True) if chosen) for mask in (moves, ~moves)]
    return Sweep(over, *parts)


def sweep_text(rows: pd.DataFrame) -> str:
    """Which actuators of an end block move along a curve, and what the others hold: "P1, P3 at 20 kPa"; "" for a single
    actuator."""
    several = pressures(rows)
    if len(several) == 1:
        return ""
    found = sweep(rows)
    largest = rows[[q.column for q in several]].to_numpy().max()
    shown = [(q, rows[q.column].mean()) for q in found.held]
    held = [f"{q.symbol} at {mean:.3g} kPa" for q, mean in shown if mean > NONE * largest]
    return ", ".join(part for part in (" + ".join(q.symbol for q in found.moved), *held) if part)


def moving_actuators(values: np.ndarray) -> np.ndarray:
    """Which actuators move, (k,) bool. values: (n, k), the pressures of a curve's rows."""
    change = np.ptp(values, axis=0)
    moves: np.ndarray = change > HELD * change.max()
    return moves


def leads(values: np.ndarray) -> list[int]:
    """The actuators, those first that change most, and of these the one that does so from row to row."""
    change, way = np.ptp(values, axis=0), np.abs(np.diff(values, axis=0)).sum(axis=0)
    much = change >= (1 - HELD) * change.max()
    return sorted(range(len(change)), key=lambda i: (not much[i], -way[i] if much[i] else -change[i]))


def as_one(values: np.ndarray) -> bool:
    """Whether all pressures are the same in every row."""
    return bool(np.ptp(values, axis=1).max() <= HELD * np.ptp(values, axis=0).max())


def imposed(table: pd.DataFrame) -> np.ndarray:
    """The pressures, (N, k) kPa."""
    values: np.ndarray = table[[q.column for q in pressures(table)]].to_numpy(dtype=np.float64)
    return values


# Which rows of a table make up a curve.

# Pressures move together where they are correlated like this, in rows enough to tell.
TOGETHER, ENOUGH = 0.98, 4
# Gaps between neighboring pressures, as shares of what an actuator goes through, are jitter below the first; levels are
# told apart by the first gap that is so many times the next smaller one, or else by the one that is most times it.
JITTER, CLEAR = 0.01, 4.0
# Groups of rows above this share of the longest are about as long.
LONG = 0.8
# A level wider than this share of what the actuator goes through is none; its pressures are told apart in steps.
WIDE, STEPS = 0.2, 20


def curves_of(table: pd.DataFrame, state: np.ndarray) -> np.ndarray:
    """Number of each row's curve, (N,), 0, 1, … in order of the states. state: of each row, (N,).

    A single actuator has a curve in each state. A line through rows in which several actuators of an end block change
    in turn would zigzag: there a curve has those rows of its state in which all are held but one, or but those that
    move together."""
    if len(pressures(table)) == 1:
        return state
    values = imposed(table)
    widest = np.ptp(values, axis=0).max()
    level = np.stack([levels(column, widest) for column in values.T], axis=1)
    number, count = np.zeros(len(table), dtype=np.int64), 0
    for n in np.unique(state):
        rows = np.flatnonzero(state == n)
        number[rows] = count + _curves(values[rows], level[rows])
        count = number[rows].max() + 1
    return number


def levels(pressure: np.ndarray, widest: float = 0.0) -> np.ndarray:
    """Number of the level that each of an actuator's pressures is at, (N,). widest: what the actuator of the end block
    that moves most goes through."""
    span, order = np.ptp(pressure), np.argsort(pressure, kind="stable")
    level = np.zeros(len(pressure), dtype=np.int64)
    if span <= HELD * widest:
        return level
    gaps = np.diff(pressure[order])
    sizes = np.sort(gaps[gaps > JITTER * span])
    if len(sizes):
        times = sizes / np.r_[JITTER * span, sizes[:-1]]
        least = sizes[np.argmax(times >= CLEAR) if (times >= CLEAR).any() else times.argmax()]
        level[order[1:]] = np.cumsum(gaps >= least)
    if not len(sizes) or pd.Series(pressure).groupby(level).agg(np.ptp).max() > WIDE * span:
        level = np.round((pressure - pressure.min()) / span * STEPS).astype(np.int64)
    return level


def _curves(values: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Number of the curve of each of a state's rows, (n,), in order of their first rows. values, level: (n, k)."""
    number, rest = np.zeros(len(values), dtype=np.int64), np.arange(len(values))
    while len(rest):
        group, taken = _lines(values[rest], level[rest])
        number[rest] = number.max() + 1 + group
        rest = rest[~taken]
    first, inverse = np.unique(number, return_index=True, return_inverse=True)[1:]
    ordered: np.ndarray = np.argsort(np.argsort(first))[inverse]
    return ordered


def _lines(values: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of groups of rows in which one actuator moves over levels of the others, the same actuator in all of
    them, (n,), and which rows are in such a group, (n,) bool; every row on its own level where there is none. The
    actuator: the first of the leads with a group that is about as long as any."""
    found = []
    for lead in leads(values):
        fixed = np.where(_along(values, lead), 0, level)
        group = np.unique(fixed, axis=0, return_inverse=True)[1].ravel()
        met = pd.Series(level[:, lead]).groupby(group).nunique().to_numpy()
        taken = met[group] > 1
        found.append((group, taken, np.bincount(group[taken]).max(initial=0)))
    longest = max(length for *_, length in found)
    if not longest:
        alone: np.ndarray = np.unique(level, axis=0, return_inverse=True)[1].ravel()
        return alone, np.ones(len(values), dtype=bool)
    return next((group, taken) for group, taken, length in found if length >= LONG * longest)


def _along(values: np.ndarray, lead: int) -> np.ndarray:
    """Which actuators move with this one, itself included, (k,) bool."""
    along: np.ndarray = np.arange(values.shape[1]) == lead
    if as_one(values):
        return along | True
    moves = moving_actuators(values)
    if len(values) < ENOUGH or not moves[lead]:
        return along
    for i in np.flatnonzero(moves & ~along):
        along[i] = abs(np.corrcoef(values[:, i], values[:, lead])[0, 1]) >= TOGETHER
    return along
