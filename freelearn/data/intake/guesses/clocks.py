"""Which channels of a file go by which of its clocks: several pairs of a time and its readings side by side;
and whether rows are samples of recordings, or readings that stand for themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from freelearn.common.formats import listed
from freelearn.data.beds import BEDS
from freelearn.data.intake.guesses.guessed import NO, Clock, ColumnGuess, Guess, Log
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.headings import time_unit
from freelearn.data.intake.laboratory_units import conversion
from freelearn.data.intake.readers.cells import is_blank
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.readers.stamps import seconds
from freelearn.data.intake.recipes.recipe import READINGS, STATE
from freelearn.data.table.log_tables import FEWEST

# What a clock's rows are readings of.
CHANNELS = (*STATE, *READINGS, "temperature_c")
# A clock has so many readings, and rises in nearly all of them: single stamps may be out of order.
LEAST_READINGS, FALLING = 3, 0.1
# Two columns tell one time if they agree up to this share of a step; from beginnings that lie apart, of the whole:
# one of them may be written in whole seconds.
SAME, ROUGHLY = 1e-3, 0.05
# No recording goes on for so long [s]; days since 1900 that a spreadsheet writes are those of this century.
LONGEST, DAYS, MOST_DAYS = 100 * 86_400.0, (36_000.0, 73_000.0), 2.0
# The key of the question whose rows the table has.
WHOSE_ROWS = "clock"


def with_times(raw: RawTable, columns: Sequence[ColumnGuess]) -> list[ColumnGuess]:
    """The columns with those marked that may be clocks: whose words say time, or nothing known, and whose numbers rise;
    or dates."""
    out: list[ColumnGuess] = []
    known: list[tuple[str, np.ndarray]] = []
    for column in columns:
        unit = time_unit(column.name, raw.units.get(column.name, ""))
        if column.name in raw.firsts and unit is None:
            column, unit = replace(column, quantity="time_s", unit="", confidence="unsure"), ""
        if column.quantity not in (None, "time_s") and unit is None:
            out.append(column)
            continue
        values = raw.most_numbers(column.name) if column.numeric else _dates(raw, column)
        if values is not None and column.numeric and column.quantity in (None, "time_s") and not (unit or column.unit):
            column = _since_1970(column, values)
        if values is None or not _rises(values):
            # Where several recordings follow each other it falls between them.
            out.append(column if column.numeric or values is None else _dated(column, values, unit is not None))
            continue
        if not column.numeric:
            column = _dated(column, values, unit is not None)
        same = next((name for name, before in known if _same(before, values)), column.name)
        if unit is not None and column.quantity != "time_s" and column.numeric:
            column = replace(column, quantity="time_s", unit=unit, confidence="likely")
        if column.quantity == "time_s":
            known.append((column.name, values))
        out.append(replace(column, clock=same, blanks=_blanks(raw, column)))
    return out


def time_of(raw: RawTable, column: ColumnGuess) -> np.ndarray | None:
    """The times of a column's rows (N,), in its unit, those of dates in seconds; NaN where blank; None where there are
    none. Raises UserError where one of several dates is none."""
    return raw.seconds(column.name) if column.dates else raw.most_numbers(column.name)


def _dates(raw: RawTable, column: ColumnGuess) -> np.ndarray | None:
    """Seconds of a column of dates or times of day that are not all one, (N,), NaN where blank; None where the cells
    are no dates."""
    cells = raw.text(column.name)
    filled = [cell for cell in cells if not is_blank(cell)]
    if len(filled) < LEAST_READINGS or (":" not in filled[0] + filled[-1] and "T" not in filled[0]):
        return None
    values, bad = seconds(cells)
    there = values[np.isfinite(values)]
    return values if len(there) > len(bad) and np.ptp(there) > 0 else None


def _dated(column: ColumnGuess, values: np.ndarray, worded: bool) -> ColumnGuess:
    """The column as a clock of dates. values: in seconds. worded: whether its heading says time."""
    began = float(values[np.isfinite(values)][0])
    dated = replace(column, dates=True, began=began, clock=column.name, words=())
    return replace(dated, quantity="time_s", confidence="sure" if worded else "likely")


def _since_1970(column: ColumnGuess, values: np.ndarray) -> ColumnGuess:
    """A time of which no heading says the unit, where its numbers do: seconds since 1970 in this century, or
    thousandths and so on of one; or days since 1900 with their fractions, as spreadsheets have them."""
    there = values[np.isfinite(values)]
    first, span = float(there[0]), float(np.ptp(there))
    factors = {unit: conversion(unit, "s").factor for unit in ("s", "ms", "µs", "ns", "day")}
    century = (1e9, 4.1e9)
    fitting = [unit for unit in ("s", "ms", "µs", "ns") if century[0] <= factors[unit] * first <= century[1]]
    if fitting and span * factors[fitting[0]] < LONGEST and _rises(values):
        return replace(column, quantity="time_s", unit=fitting[0], confidence="likely")
    in_days = DAYS[0] <= first <= DAYS[1] and span < MOST_DAYS and (there != there.round()).any()
    return replace(column, unit="day", confidence="likely") if in_days and column.quantity == "time_s" else column


def _blanks(raw: RawTable, column: ColumnGuess) -> int:
    return sum(map(is_blank, raw.columns[column.name]))


def _rises(values: np.ndarray) -> bool:
    there = values[np.isfinite(values)]
    return len(there) >= LEAST_READINGS and bool(there[-1] > there[0]) and float((np.diff(there) < 0).mean()) <= FALLING


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two columns tell one time of each row, in two units, or from two beginnings that lie apart; a shift by
    less is that of a second clock."""
    there = np.isfinite(one)
    if (there != np.isfinite(other)).any():
        return False
    one, other = one[there], other[there]
    factor = float((other[-1] - other[0]) / (one[-1] - one[0]))
    shift = float(other[0] - factor * one[0])
    little = SAME * factor * float(np.median(np.abs(np.diff(one))))
    off = float(np.abs(other - factor * one - shift).max())
    if other[-1] < factor * one[0] or other[0] > factor * one[-1]:
        return off <= ROUGHLY * float(other[-1] - other[0])
    return max(off, abs(shift)) <= little


def clocks_of(columns: Sequence[ColumnGuess], bed: str, pressures: Sequence[str]) -> tuple[Clock, ...]:
    """The clocks with the chosen channels beside each; () where all go by one. The first is the one whose rows the
    table has: of most of what the bed measures, so that no reading is counted twice. pressures: of several actuators,
    which are not joined: () where they go by several clocks."""
    channels: dict[str, list[str]] = {}
    for _, group in groupby(columns, key=lambda c: c.place):
        there = [c for c in group if c.is_clock or (c.chosen and c.column in CHANNELS)]
        if there and not there[0].is_clock and there[-1].is_clock and not there[-1].dates:
            # Each time stands behind what it stamps.
            there.reverse()
        now = next((c.clock for c in there if c.is_clock), "")
        for column in there:
            if column.is_clock:
                now = column.clock
            else:
                channels.setdefault(now, []).append(column.name)
    holding = {clock for clock, own in channels.items() if set(own) & set(pressures)}
    if len(channels) < 2 or len(holding) > 1 or "" in channels:
        return ()
    by_name = {c.name: c for c in columns}
    measured, imposed = ([q.column for q in kind] for kind in (BEDS[bed].measured, BEDS[bed].imposed))

    def rank(name: str) -> tuple[bool, bool, int, int]:
        own = [by_name[channel].column for channel in channels[name]]
        return (name not in holding, by_name[name].dates, -len({*own} & {*measured}), -len({*own} & {*imposed}))

    return tuple(Clock(name, tuple(channels[name])) for name in sorted(channels, key=rank))


def in_order(found: Guess, answers: Mapping[str, str | float]) -> tuple[Clock, ...]:
    """The clocks as somebody said: first the one whose rows the table has; () where nothing is to be joined."""
    said = answers.get(WHOSE_ROWS)
    if said == NO:
        return ()
    return tuple(sorted(found.clocks, key=lambda clock: clock.time != said)) if said else found.clocks


def of_one_clock(raw: RawTable, found: Guess, clock: Clock) -> tuple[RawTable, Guess]:
    """The rows that a clock stamps, and the guess at what goes by no other."""
    for piece in raw.pieces:
        if clock.time in piece.names:
            raw = replace(piece.table, columns={n: piece.table.columns[own] for n, own in piece.names.items()})
    others = {name for other in found.clocks if other is not clock for name in (other.time, *other.channels)}
    rows = [row for row, cell in enumerate(raw.text(clock.time)) if not is_blank(cell)]
    names = [name for name in raw.columns if name not in others]
    own = replace(raw.rows(rows), columns={name: [raw.columns[name][row] for row in rows] for name in names})
    columns = tuple(replace(c, chosen=c.chosen and c.name not in others) for c in found.columns)
    return own, replace(found, columns=columns, clocks=())


def clocks_in_words(found: Guess, clocks: Sequence[Clock]) -> str:
    """What is assumed of the clocks, in a sentence."""
    lead, *others = clocks
    told = "; ".join(f"{_listed(clock.channels)} by {_where(found, clock)}" for clock in others)
    return (
        f"there are {len(clocks)} clocks: {_listed(lead.channels)} by {_where(found, lead)}, whose rows the table has, "
        f"and joined to them by time {told}"
    )


def _where(found: Guess, clock: Clock) -> str:
    """A clock's name, with where it stands, if not in the same table as others."""
    place = found.named(clock.time).place.called
    return f"{clock.time!r}{f' of {place}' if place and not clock.time.startswith(place) else ''}"


def _listed(names: Sequence[str]) -> str:
    return listed([repr(name) for name in names])


# So many rows at least look like a log; from one sample to the next what was set moves, in the median, by no more than
# this share of its range: from one averaged reading to the next it moves by a step.
LEAST_SAMPLES, CLOSE = 50, 0.04


def log_of(raw: RawTable, found: Guess) -> Log | None:
    """What the rows would be as a log; None where they have no time, or are too few. raw: without sums."""
    several = bool(found.clocks)
    if several:
        raw, found = of_one_clock(raw, found, found.clocks[0])
    column = found.of("time_s")
    if column is None or len(raw) < FEWEST:
        return None
    time = time_of(raw, column)
    if time is None:
        return None
    time = time[np.isfinite(time)]
    falls = np.flatnonzero(np.diff(time) < 0) + 1
    shortest = int(np.diff(np.concatenate([[0], falls, [len(time)]])).min())
    # No averages at rest are written by several clocks.
    samples = len(time) >= LEAST_SAMPLES and shortest >= FEWEST and (several or _close(raw, found))
    return Log(len(falls) + 1, samples)


def _close(raw: RawTable, found: Guess) -> bool:
    """Whether nothing that was set jumps from row to row."""
    moves = []
    for column in found.columns:
        if not column.chosen or column.column not in STATE or not MEANINGS[column.quantity or ""].kind:
            continue
        values = raw.most_numbers(column.name)
        if values is not None and np.nanmax(values) > np.nanmin(values):
            steps = np.abs(np.diff(values[np.isfinite(values)]))
            moves.append(float(np.median(steps)) / float(np.nanmax(values) - np.nanmin(values)))
    return bool(moves) and max(moves) <= CLOSE
