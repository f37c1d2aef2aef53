"""What changes along a curve: of the actuators on an end block those that move, and what the others hold."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from freelearn.measurements.beds import PRESSURE, Quantity
from freelearn.results.quantities import pressures

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
