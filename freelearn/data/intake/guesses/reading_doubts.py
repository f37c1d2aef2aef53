"""What the readings of a file mean: a sensor's zero, an absolute pressure, a place that scatters, slack."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from freelearn.data.beds import BEDS
from freelearn.data.intake.guesses.guessed import NO, YES, ColumnGuess, Doubt, Guess
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.laboratory_units import ABSOLUTE, conversion, in_units_of
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.suspicious import gauge_at_rest

# A reading of exactly 0 in so many rows is no chance.
LEAST_ZEROS = 3
# At rest a sensor reads nothing, up to this share of the range of its readings.
REST_SHARE = 0.03
# A supply that is shut holds a tube open by so much of its range.
GAUGE_SHARE = 0.06
# Levels of what was set lie so many times farther apart than its readings scatter, and each is visited so often.
LEVELS_APART, LEAST_VISITS, LEAST_ROWS = 5.0, 2, 8
# The atmosphere, and what it is between the sea and high valleys [kPa].
ATMOSPHERE, SOMEWHERE = 101.325, (75.0, 110.0)
# Taken off a pressure of which somebody has said that it is what its gauge reads: then nobody doubts it again.
AS_IT_READS = 0.0


def reading_doubts(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """raw: without rows that sum up others."""
    if found.bed != "dead_load":
        yield from _levels(raw, found)
    yield from pressure_doubts(raw, found)
    if found.bed != "dead_load":
        yield from _zeros(raw, found)
        yield from _slack(raw, found)


def _levels(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Places that were set and scatter a little."""
    for column in found.measured:
        if column.column not in ("elongation_mm", "twist_deg") or MEANINGS[column.quantity or ""].kind == "ratio":
            continue
        values = raw.most_numbers(column.name)
        spread = None if values is None else levels_of(values[~np.isnan(values)])
        if spread is None:
            continue
        levels, within, between = spread
        unit = f" {column.unit}" if column.unit else ""
        text = (
            f"Column {column.name!r} scatters by {within:.2g}{unit} about {levels} levels, {between:.2g}{unit} apart. "
            "Are readings of one level the same place?"
        )
        tolerance = in_units_of(column.column, column.unit, float(f"{(within * between) ** 0.5:.2g}"))
        changes = {YES: {"state_tolerance": {column.column: tolerance}}}
        short = f"levels of {column.name!r}"
        yield Doubt(f"levels.{column.name}", text, short, proposed=YES, of=column.meant, changes=changes)


def levels_of(values: np.ndarray) -> tuple[int, float, float] | None:
    """How many levels values scatter about, how far at most each, and how far apart they lie at least; None where they
    stand on levels already, or on none.

    >>> levels_of(np.array([0, 0.1, 0.05, 5, 5.1, 5, 0.1, 0]))
    (2, 0.1, 4.9)
    """
    distinct = np.unique(values)
    gaps = np.sort(np.diff(distinct))
    if len(gaps) < 2 or len(values) < LEAST_ROWS:
        return None
    place = int((gaps[1:] / gaps[:-1]).argmax())
    group = np.concatenate([[0], np.cumsum(np.diff(distinct) > 0.5 * (gaps[place] + gaps[place + 1]))])
    levels, between = int(group[-1]) + 1, float(gaps[place + 1])
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    ends = np.append(starts[1:], len(distinct)) - 1
    width = float((distinct[ends] - distinct[starts]).max())
    visits = np.bincount(group[np.searchsorted(distinct, values)])
    if len(distinct) == levels or visits.min() < LEAST_VISITS or between <= LEVELS_APART * width:
        return None
    return levels, width, round(between, 12)


def pressure_doubts(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Whether the pressures have the atmosphere in them, or what their gauges read at rest."""
    yield from list(_absolute(found)) or _gauges(raw, found)


def _absolute(found: Guess) -> Iterator[Doubt]:
    several = [c for c in found.columns if c.name in found.pressures]
    pressures = several or [c for c in [found.of("pressure_kpa")] if c is not None]
    if not pressures or not all(c.unit and c.numeric for c in pressures):
        return
    lowest = [in_units_of("pressure_kpa", c.unit, c.low) for c in pressures]
    said = all(_says_absolute(c) for c in pressures)
    if said or all(SOMEWHERE[0] <= low <= SOMEWHERE[1] for low in lowest):
        text = f"The pressure is never below {lowest[0]:.4g} kPa. Is it absolute, with the atmosphere in it?"
        of = {name: meaning for c in pressures for name, meaning in c.meant.items()}
        changes = {
            said: {"pressures": {c.name: {"minus": value} for c in pressures}}
            for said, value in ((YES, ATMOSPHERE), (NO, AS_IT_READS))
        }
        proposed = YES if said else None
        yield Doubt("absolute", text, "pressure is absolute", proposed=proposed, of=of, changes=changes)


def _says_absolute(column: ColumnGuess) -> bool:
    """Whether a heading says that the atmosphere is in its pressures: psia, P_abs."""
    return column.unit.strip().lower() in ABSOLUTE or bool(re.search(r"(^|[^a-z])abs", column.name.lower()))


def _gauges(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Pressures that are never near zero, where a gauge may read too much at rest."""
    visit = _visits(raw, found)
    for column in found.measured:
        values = raw.most_numbers(column.name) if column.quantity == "pressure_kpa" and column.unit else None
        if values is None:
            continue
        change = conversion(column.unit, "kPa")
        lowest, back = (
            None if kpa is None else float(f"{(kpa - change.shift) / change.factor:.6g}")
            for kpa in gauge_at_rest(change.factor * values + change.shift, visit, not found.pressures)
        )
        if lowest is None and back is None:
            continue
        said = {
            "lowest": (lowest, "its lowest reading"),
            "back": (back, "to which it goes back"),
        }
        options = [
            (key, f"{value:g} {column.unit}, {words}") for key, (value, words) in said.items() if value is not None
        ]
        short = f"what {column.name!r} reads at rest"
        options.append((NO, "less: the tube was under pressure all the time"))
        changes = {key: {"pressures": {column.name: {"offset": value}}} for key, (value, _) in said.items()}
        changes |= {NO: {"pressures": {column.name: {"minus": AS_IT_READS}}}}
        text = f"The pressure {column.name!r} is never near 0. What does its gauge read at rest, to be taken off?"
        yield Doubt(f"rest.{column.name}", text, short, tuple(options), of=column.meant, changes=changes)


def _visits(raw: RawTable, found: Guess) -> np.ndarray:
    """The number of the visit to a place, or a load, that each row belongs to; rows sorted by pressure are one visit to
    each."""
    imposed = {q.column for q in BEDS[found.bed].state}
    chosen = [raw.most_numbers(c.name) for c in found.measured if c.column in imposed]
    places = np.stack([np.zeros(len(raw)), *(np.nan_to_num(values) for values in chosen if values is not None)], axis=1)
    if found.order_by:
        return np.unique(places, axis=0, return_inverse=True)[1].ravel()
    moves = (np.diff(places, axis=0) != 0).any(axis=1)
    return np.cumsum(np.concatenate([[False], moves]))


def _zeros(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Loads that are not 0 where nothing acts on the actuator."""
    row = _resting_row(raw, found)
    for column in found.measured if row is not None else ():
        values = raw.most_numbers(column.name) if column.quantity in ("force_n", "moment_nmm") else None
        if values is None or np.isnan(values[row]):
            continue
        if abs(values[row]) <= REST_SHARE * float(np.nanmax(values) - np.nanmin(values)):
            continue
        reads = f"{values[row]:.4g} {column.unit}".rstrip()
        text = (
            f"At rest (line {raw.lines[row or 0]}: no elongation, no twist, the lowest pressure) {column.name!r} reads "
            f"{reads}. Is that the sensor's zero, to be taken off every reading?"
        )
        changes = {YES: {"columns": {column.column: {"offset": float(values[row])}}}}
        short = f"zero of {column.name!r} taken off"
        yield Doubt(f"zero.{column.name}", text, short, of=column.meant, changes=changes)


def _resting_row(raw: RawTable, found: Guess) -> int | None:
    """The first row in which nothing acts: the lowest pressure, neither elongation nor twist; None without one."""
    rests = np.ones(len(raw), dtype=bool)
    places = [c for c in found.measured if c.quantity in ("elongation_mm", "shortening", "strain", "twist_deg")]
    pressures = [c for c in found.measured if c.quantity == "pressure_kpa"]
    if not pressures or not any(c.column == "elongation_mm" for c in places):
        return None
    for column in (*pressures, *places):
        values = raw.most_numbers(column.name)
        if values is None:
            return None
        level, share = (np.nanmin(values), GAUGE_SHARE) if column in pressures else (0.0, REST_SHARE)
        rests &= np.abs(values - level) <= share * float(np.nanmax(values) - np.nanmin(values))
    return int(rests.argmax()) if rests.any() else None


def _slack(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    column = found.of("force_n")
    values = None if column is None else raw.most_numbers(column.name)
    if column is None or values is None or any(c.chosen and c.quantity == "slack" for c in found.columns):
        return
    zeros = int((values == 0).sum())
    one_sided = (values > 0).any() != (values < 0).any()
    if zeros >= LEAST_ZEROS and one_sided:
        text = f"In {zeros} rows the force is exactly 0. Did the actuator hang loose there, so that it could not push?"
        changes = {YES: {"slack": {column.name: 0}}}
        yield Doubt("slack", text, "slack where the force is 0", of=column.meant, changes=changes)
