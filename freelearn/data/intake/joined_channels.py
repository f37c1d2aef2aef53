"""Channels that another logger wrote at its own rate, joined by time onto the rows of a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from freelearn.common.errors import UserError
from freelearn.data.intake.evaluate import NAMED, Evaluation
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.readers.stamps import moment, seconds_of
from freelearn.data.intake.recipes.recipe import DATE, Column, Join, Part, Reading, Recordings
from freelearn.data.logs import TIME
from freelearn.data.table.log_tables import NO_FASTER, averaged, jump, smoothed

# A gap is longer than so many of a channel's usual steps, where the recipe does not say.
GAP = 5.0
# Of its usual step, what rounding may do to a channel's time.
ROUNDING = 1e-6


def with_joined(
    joins: Sequence[Join],
    part: Part,
    rows: Evaluation,
    imposed: Sequence[str],
    reading: Reading,
    sources: Mapping[str, bytes],
    recordings: Recordings | None = None,
) -> tuple[Evaluation, np.ndarray, list[dict[str, Any]]]:
    """The rows with each joined channel beside their constants; which of them are kept, (N,) bool: those that all
    sources span and in which nothing imposed is blank; what was done, plain values.

    part: the file of the rows. imposed: columns that may not be blank. reading: of that file. recordings:
    how they are told; a column that stands in a joined file names those of the rows, too. Raises UserError where two
    logs have no time in common, or a clock runs backwards or jumps.
    """
    kept = np.ones(len(rows.raw), dtype=bool)
    if not joins:
        return rows, kept, []
    asked = _clock(rows, "columns.time_s")
    named = (recordings.source if recordings else None) or ""
    told = []
    constants = dict(rows.constants)
    for place, join in enumerate(joins, start=1):
        name = join.file or part.name
        raw = raw_table(sources[name], name, join.reading or (Reading() if join.file else reading))
        if join.reading and not join.file:
            raw = replace(raw, name=Part(name, reading=join.reading).label)
        _same_kind(join, place, raw, rows)
        source = _source(join, raw, rows)
        time = _clock(source, f"join[{place}].time")
        if named in raw.columns and named not in rows.raw.columns:
            rows.words[NAMED] = _as_named(source.raw.text(named), time, asked)
        record = _joined(join, place, source, time, asked, rows.raw.name, constants)
        kept &= record.pop("inside")
        rows.records.update(source.records | {TIME: rows.records[TIME]})
        rows.notes += [*raw.notes, *source.notes]
        told.append(record)
    for join in joins:
        for name in set(join.columns) & set(imposed):
            kept &= np.isfinite(constants[name])
    rows.constants = constants
    for record in told:
        record["rows_lost"] = int((~kept).sum())
        rows.notes.append(_sentence(record))
    return rows, kept, told


def _source(join: Join, raw: RawTable, rows: Evaluation) -> Evaluation:
    """The quantities of the joined rows that have a time; of constants those that are the same in all rows. Rows
    without a time are those of a shorter channel beside longer ones."""
    whole = Evaluation(raw, {TIME: join.time}, {}, np.ones(len(raw), dtype=np.int64))
    there = np.flatnonzero(np.isfinite(whole.read(join.time)))
    if not len(there):
        raise UserError(f"{raw.name}: column {join.time.source!r} holds no time: name another one as time:.")
    raw = raw.rows(there)
    shared = {n: np.full(len(raw), v[0]) for n, v in rows.constants.items() if len(v) and (v == v[0]).all()}
    return Evaluation(raw, {TIME: join.time, **join.columns}, shared, np.ones(len(raw), dtype=np.int64))


def _as_named(words: Sequence[str], time: np.ndarray, asked: np.ndarray) -> list[str]:
    """At the asked times what a channel's last row before them says, or its first one."""
    place = (np.searchsorted(time, asked, side="right") - 1).clip(0)
    return [words[row] for row in place]


def _same_kind(join: Join, place: int, raw: RawTable, rows: Evaluation) -> None:
    """Raises UserError where one clock says dates and the other seconds, and nothing when these begin; or where the
    recipe takes dates for numbers."""
    clocks = {"columns.time_s": (rows.columns[TIME], rows.raw), f"join[{place}].time": (join.time, raw)}
    for key, (column, table) in clocks.items():
        first = _first(table, column)
        if column.unit != DATE and seconds_of(first) is not None:
            raise UserError(
                f"{table.name}: column {column.source!r} of {key} holds dates or times of day ({first}), no numbers: "
                f"give it unit: {DATE}, if the other clock has dates, too; else write its seconds into the file."
            )
    of = {column.unit == DATE: (key, column, table) for key, (column, table) in clocks.items()}
    if len(of) == 1 or any(column.plus or column.minus for column, _ in clocks.values()):
        return
    key, column, table = of[True]
    began = seconds_of(_first(table, column)) or 0.0
    raise UserError(
        f"{raw.name} and {rows.raw.name} have no common start: {key} holds dates, from {moment(began)} on, and "
        f"{of[False][0]} counts seconds: give {key} minus: {began:.15g}, if that is when the seconds begin, else the "
        "seconds since 1970 at which they do."
    )


def _first(table: RawTable, column: Column) -> str:
    """The first cell that is not blank, "" where all are."""
    return next((cell.strip() for cell in table.columns[table.known(column.source)] if cell.strip()), "")


def _clock(rows: Evaluation, key: str) -> np.ndarray:
    """Time [s] of the rows, (N,), which never falls. Raises UserError."""
    time, raw = rows.quantity(TIME), rows.raw
    blank = np.flatnonzero(~np.isfinite(time))
    if len(blank):
        raise UserError(f"{raw.name}, line {raw.lines[blank[0]]}: {TIME} is blank: drop the row, or give its time.")
    back = np.flatnonzero(np.diff(time) < 0)
    if len(back):
        line = raw.lines[back[0] + 1]
        raise UserError(
            f"{raw.name}, line {line}: the time of {key} runs backwards, from {time[back[0]]:g} to "
            f"{time[back[0] + 1]:g} s, and channels are joined by one clock: put what follows into a file of its own, "
            "or put the rows in order."
        )
    return time


def _joined(
    join: Join,
    place: int,
    source: Evaluation,
    time: np.ndarray,
    asked: np.ndarray,
    name: str,
    constants: dict[str, np.ndarray],
) -> dict[str, Any]:
    """Adds the channels of one source at the asked times to `constants`, and tells of it. name: of the rows' file."""
    raw = source.raw
    once = np.unique(time)
    if len(once) < 2:
        raise UserError(f"{raw.name}: join[{place}] has one time, {once[0]:g} s: a channel needs two or more.")
    if (jumped := jump(np.diff(time))) is not None:
        raise UserError(
            f"{raw.name}, line {raw.lines[jumped + 1]}: the time of join[{place}] jumps from {time[jumped]:g} to "
            f"{time[jumped + 1]:g} s: correct the clock, or put what follows into a file of its own."
        )
    if time[-1] < asked[0] or time[0] > asked[-1]:
        raise UserError(
            f"{raw.name} and {name} have no time in common: join[{place}] runs from {time[0]:.10g} to "
            f"{time[-1]:.10g} s, the rows from {asked[0]:.10g} to {asked[-1]:.10g} s: correct the unit of a time, or "
            f"set the clock right with plus: or minus: seconds in join[{place}].time."
        )
    # Of rows between which the channel is blank, those that have a reading.
    filled = np.unique(time[np.isfinite([source.quantity(column) for column in join.columns]).any(axis=0)])
    step = float(np.median(np.diff(filled if len(filled) > 1 else once)))
    steps = np.diff(np.unique(asked))
    new_step = float(np.median(steps)) if len(steps) else step
    gap = GAP * step if join.gap_s is None else join.gap_s
    # Two clocks' stamps of one instant differ by what setting one to the other rounds off.
    rounding = ROUNDING * step
    faster = new_step >= NO_FASTER * step
    lost = {}
    for column in join.columns:
        values = source.quantity(column)
        known = np.isfinite(values)
        at, mean = averaged(time[known], values[known])
        if len(at) < 2:
            raise UserError(
                f"{raw.name}: column {join.columns[column].source!r} has fewer than two readings: leave it out."
            )
        even, line = at, mean
        if faster:
            even, line, lost[column] = smoothed(at, mean, step, new_step, (time[0], time[-1]))
        constants[column] = np.where(_far(at, asked, gap, rounding), np.nan, np.interp(asked, even, line))
    return {
        "file": raw.name,
        "rows": len(raw),
        "columns": list(join.columns),
        "rate_hz": 1 / step,
        "rows_rate_hz": 1 / new_step,
        "filtered_rms": lost,
        "from_s": float(max(time[0], asked[0])),
        "to_s": float(min(time[-1], asked[-1])),
        "gap_s": gap,
        "stamps_twice": len(time) - len(once),
        "blanks": {column: int(np.isnan(constants[column]).sum()) for column in join.columns},
        "inside": (asked >= time[0] - rounding) & (asked <= time[-1] + rounding),
    }


def _far(at: np.ndarray, asked: np.ndarray, gap: float, rounding: float) -> np.ndarray:
    """Asked times (n,) that lie beyond the readings at `at`, or between two that are farther apart than the gap, and at
    none of them."""
    after = np.searchsorted(at, asked)
    low, high = at[(after - 1).clip(0)], at[after.clip(0, len(at) - 1)]
    outside = (after == 0) | (after == len(at)) | (high - low > gap + rounding)
    return np.asarray(outside & (np.minimum(np.abs(asked - low), np.abs(high - asked)) > rounding))


def _sentence(record: Mapping[str, Any]) -> str:
    """What was done, for the reader."""
    columns = ", ".join(record["columns"])
    rates = f"{record['rate_hz']:.4g} Hz onto rows at {record['rows_rate_hz']:.4g} Hz"
    gone = ", ".join(f"{size:.2g} of {name}" for name, size in record["filtered_rms"].items() if size > 0)
    how = (
        f"through a low-pass (what was faster is gone, rms {gone or 0})"
        if record["filtered_rms"]
        else "by straight lines"
    )
    blank = ", ".join(f"{name} in {count}" for name, count in record["blanks"].items() if count)
    said = (
        f"{record['file']}: {columns} joined by time, {rates}, {how}; both run from {record['from_s']:.6g} to "
        f"{record['to_s']:.6g} s, and {record['rows_lost']} rows are left out, outside of what is joined"
    )
    said += f"; across gaps longer than {record['gap_s']:.3g} s, or outside, blank: {blank}" if blank else ""
    twice = record["stamps_twice"]
    said += (
        f"; {twice} stamps stand there twice and became their mean: export the time with more digits" if twice else ""
    )
    return f"{said}."
