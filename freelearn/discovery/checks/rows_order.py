"""Whether the rows were sorted, so that states and branches of rising and falling pressure are lost."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from freelearn.data.beds import bed_of
from freelearn.data.columns import Columns
from freelearn.data.states import kinematic_state
from freelearn.discovery.checks.table_check import CANNOT, FAIL, PASS, TableCheck

NAME = "order of the rows"
# Rows of a sample below which an order may be chance, and the share of steps, or of times, that run backwards.
FEWEST, BACK = 12, 0.15
# Values of one level differ by less than this share of the range.
LEVEL = 2e-3
# Two levels in a row are one if they differ by less than this share of the others' distance.
TWINS = 0.25


def order(table: pd.DataFrame) -> TableCheck:
    """Whether the order of the file is that of measuring, as far as the rows can tell."""
    for _, rows in table.groupby("sample", sort=False):
        if len(rows) < FEWEST:
            continue
        for says in _signs(rows.reset_index(drop=True)):
            return TableCheck(
                NAME, FAIL, None, None,
                f"The rows were sorted: {says}; rising cannot be told from falling pressure, nor one state from the "
                "next: give the rows in the order of measuring, by time_s or as they were logged.",
            )  # fmt: skip
    if all(len(rows) < FEWEST for _, rows in table.groupby("sample")):
        return TableCheck(NAME, CANNOT, None, None, "Too few rows to tell whether they were sorted.")
    return TableCheck(NAME, PASS, None, None, "Nothing says that the rows were sorted.")


def _signs(rows: pd.DataFrame) -> Iterator[str]:
    """What says so of one sample's rows (n), as clauses."""
    bed, pressures = bed_of(rows), [name for name in Columns.from_table(rows).pressures if name in rows]
    place = _place(rows)
    yield from _backwards(rows)
    yield from _measured_in_order(rows, place)
    for name in pressures:
        yield from _pressure_in_order(rows, name, place)
    if len(pressures) == 1 and bed is not None:
        yield from _twice(rows, pressures[0], place)
    yield from _steps(rows, place)


def _place(rows: pd.DataFrame) -> np.ndarray:
    """Number of the nominal place of each row, (n,): where the bed stood, or what hung."""
    keys = []
    for quantity in bed_of(rows).state:
        values = rows[quantity.column].to_numpy(np.float64)
        grain = max(LEVEL * float(np.ptp(values)), 1e-9)
        keys.append(np.round(values / grain).astype(np.int64))
    return np.unique(np.stack(keys, axis=1), axis=0, return_inverse=True)[1].reshape(-1)


def _backwards(rows: pd.DataFrame) -> Iterator[str]:
    """Time itself, where the table has it."""
    if "time_s" in rows and (np.diff(rows["time_s"].to_numpy(np.float64)) < 0).mean() > BACK:
        yield "time_s runs backwards again and again"


def _measured_in_order(rows: pd.DataFrame, place: np.ndarray) -> Iterator[str]:
    """A reading scatters: over several places it never rises from the first row to the last, but where all pressures
    go one way as well, in which it may follow them."""
    pressures = (rows[name].to_numpy(np.float64) for name in Columns.from_table(rows).pressures)
    if len(np.unique(place)) < 3 or any(map(_one_way, pressures)):
        return
    for quantity in bed_of(rows).measured:
        if quantity.column not in rows:
            continue
        values = rows[quantity.column].dropna().to_numpy(np.float64)
        values = values[np.append(True, np.diff(values) != 0)] if len(values) else values
        if len(values) >= FEWEST and _one_way(values):
            yield f"{quantity.column}, a reading, {'rises' if values[-1] > values[0] else 'falls'} from row to row"


def _one_way(values: np.ndarray) -> bool:
    """Whether each value is above the one before it, or each below."""
    steps = np.diff(values)
    return bool(np.all(steps > 0) or np.all(steps < 0))


def _pressure_in_order(rows: pd.DataFrame, name: str, place: np.ndarray) -> Iterator[str]:
    """The pressure never falls (or never rises) over a sample, while the bed goes from place to place and back."""
    values = rows[name].to_numpy(np.float64)
    steps, visits = np.diff(values), int((np.diff(place) != 0).sum()) + 1
    places = len(np.unique(place))
    if places < 3 or visits < 2 * places or not (np.all(steps >= 0) or np.all(steps <= 0)):
        return
    # At a level that a bed holds a pressure scatters up and down; levels that are exact, each place once, may be how
    # it was measured, unless a place comes twice at one level.
    level = np.round(values / max(LEVEL * float(np.ptp(values)), 1e-9)).astype(np.int64)
    twice = len(rows) > 1.3 * len(np.unique(np.stack([level, place], axis=1), axis=0))
    if len(np.unique(values)) > 0.5 * len(rows) or twice:
        way = "rises" if values[-1] > values[0] else "falls"
        yield f"{name} {way} from the first row to the last through {places} places"


def _twice(rows: pd.DataFrame, name: str, place: np.ndarray) -> Iterator[str]:
    """At each place the pressure runs one way only, and levels come twice in a row, but not the highest, at which a bed
    turns: those of the way up and of the way down."""
    values = rows[name].to_numpy(np.float64)
    run = np.append(0, (np.diff(place) != 0).cumsum())
    pairs, tops, runs = 0, 0, 0
    for number in np.unique(run):
        own = values[run == number]
        if len(own) < 6:
            continue
        jump = np.diff(own)
        if not (np.all(jump >= 0) or np.all(jump <= 0)):
            return
        jump = jump if jump.sum() >= 0 else -jump[::-1]
        near = jump < TWINS * np.quantile(jump, 0.75)
        runs, pairs, tops = runs + 1, pairs + int(near[:-1].sum()), tops + int(near[-1])
    # One pair in each run at least, and the highest level single.
    if runs and pairs >= runs and tops < 0.25 * runs:
        yield f"at each place {name} runs one way only, and its levels but the highest come twice in a row"


def _steps(rows: pd.DataFrame, place: np.ndarray) -> Iterator[str]:
    """step counts in time: within a place that the bed stays at it runs backwards again and again."""
    state, step = kinematic_state(rows), rows["step"].to_numpy(np.float64)
    if len(np.unique(step)) < 3:
        return
    stays = np.diff(place) == 0
    back = stays & (np.diff(step) < 0) & (step[1:] > step.min())
    if stays.any() and back.sum() > BACK * stays.sum():
        yield f"step, which counts in time, runs backwards in {int(back.sum())} rows"
        return
    # Or every row is a visit of its own, although its step says that it was one of many in a state.
    single = len(rows) / (state.max() + 1)
    late = float((step > step.min()).mean())
    if single < 1.5 and late > 0.5 and len(rows) > 3 * len(np.unique(place)):
        yield "step counts the rows of a state, but those of one place lie all over the file"
