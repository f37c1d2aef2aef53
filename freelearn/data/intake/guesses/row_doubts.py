"""Which rows of a laboratory's file are readings, and what cells say that are no plain numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from freelearn.data.intake.guesses.clocks import time_of
from freelearn.data.intake.guesses.guessed import NO, PLATEAUS, YES, ColumnGuess, Doubt, Guess
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.joined_channels import GAP
from freelearn.data.intake.laboratory_units import conversion, in_units_of
from freelearn.data.intake.plateaus import find_plateaus
from freelearn.data.intake.readers.cells import POINTS, few, number_styles, numbers
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.readers.stamps import seconds, spread_evenly
from freelearn.data.intake.recipes.recipe import DESIGN, READINGS, STATE
from freelearn.data.intake.suspicious import summary_rows

# A log whose rows mostly stand on plateaus of so many readings.
LEAST_READINGS, LEAST_PLATEAUS, ON_PLATEAUS, STEADY = 8, 4, 0.6, 0.01
LEAST_ROWS_OF_A_LOG = 200
# Rows of words beside numbers are no more than this share.
FEW_WORDS = 0.1
MARK_BEFORE_THREE, WHOLE = re.compile(r"[+-]?[1-9]\d{0,2}\.\d{3}"), re.compile(r"[+-]?\d{1,3}")


def sums(raw: RawTable) -> Iterator[Doubt]:
    """Rows that sum up the others."""
    for column, words, lines in summary_rows(raw):
        where, verb, it = ("Lines", "sum up", "them") if lines[1:] else ("Line", "sums up", "it")
        text = f"{where} {few(lines)} ({', '.join(words)}) {verb} the others. Leave {it} out?"
        changes = {YES: {"drop": [{column: words}]}}
        yield Doubt(f"sums.{column}", text, "sums and means left out", proposed=YES, changes=changes, rows=True)


def row_doubts(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """The others. raw: without such rows."""
    yield from _words(raw, found)
    yield from _words_beside(raw, found)
    yield from _groups(raw, found)
    yield from _stamps(raw, found)
    yield from _gaps(raw, found)
    if found.order_by:
        shown = ", ".join(map(repr, found.order_by))
        text = f"The rows are sorted by pressure. Put the rows of each state together, by {shown}?"
        changes = {YES: {"order_by": list(found.order_by)}}
        yield Doubt("order", text, "rows of a state put together", proposed=YES, changes=changes, rows=True)
    yield from _plateaus(raw, found)


def cell_doubts(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Those about channels that are joined by time, whose rows are no rows of the table. raw: rows of their clock."""
    yield from _words(raw, found, joined=True)
    yield from _groups(raw, found)


def _words(raw: RawTable, found: Guess, joined: bool = False) -> Iterator[Doubt]:
    for column in found.measured:
        cells_of = raw.columns[column.name]
        bad = seconds(cells_of)[1] if column.dates else list(numbers(cells_of, raw.style).bad)
        cells = {row: cells_of[row].strip() for row in bad}
        words = list(dict.fromkeys(cells.values()))
        if not words:
            continue
        where = f"Column {column.name!r}, line {few([raw.lines[row] for row in cells])}"
        shown = ", ".join(map(repr, words[:4]))
        changes: dict[str, Mapping[str, Any]]
        if styles := number_styles(words):
            text = f"{where}: {shown}. Which number is the first of them?"
            options = (*((str(i), number) for i, (_, number) in enumerate(styles)), (NO, "none of them"))
            changes = {str(i): {"read": reading} for i, (reading, _) in enumerate(styles)}
            yield Doubt("read", text, f"{words[0]!r} is", options, of=column.meant, changes=changes, rows=True)
            return
        text = f"{where}: {shown} is no number. What of it?"
        blank = [("blank", "read those cells as blank")] if joined or column.quantity not in (*STATE, "time_s") else []
        changes = {"rows": {"drop": [{column.name: words}]}, "blank": {"columns": {column.column: {"blanks": words}}}}
        options = (*(() if joined else (("rows", "leave those rows out"),)), *blank)
        yield Doubt(f"words.{column.name}", text, where, options, of=column.meant, changes=changes, rows=True)


def _words_beside(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Rows of words in a column of numbers that is not used: those of a header in the middle of a file, perhaps."""
    for column in found.columns:
        # Of several clocks those of the others are elsewhere.
        if column.chosen or not column.numeric or column.name not in raw.columns:
            continue
        bad = list(numbers(raw.columns[column.name], raw.style).bad)
        words = list(dict.fromkeys(raw.columns[column.name][row].strip() for row in bad))
        if not words or len(bad) > FEW_WORDS * len(raw) or number_styles(words):
            continue
        where = f"line {few([raw.lines[row] for row in bad])}"
        text = (
            f"Column {column.name!r} holds numbers, but on {where} {', '.join(map(repr, words[:4]))}. Are those "
            "rows readings all the same?"
        )
        changes = {NO: {"drop": [{column.name: words}]}}
        yield Doubt(f"beside.{column.name}", text, f"rows with {words[0]!r} are readings", changes=changes, rows=True)


def _stamps(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Stamps that stand there for several rows, as they are written in whole seconds, say."""
    column = found.of("time_s")
    if column is None or found.log is None:
        return
    time = time_of(raw, column)
    if time is None or not np.isfinite(time).all():
        return
    twice = int((np.diff(time) == 0).sum())
    if 2 * twice < len(time) or spread_evenly(time) is None:
        return
    text = (
        f"{column.name!r} is in {twice} rows that of the row before. Were the rows taken evenly, and is their time "
        "only rounded?"
    )
    changes = {YES: {"columns": {"time_s": {"even": True}}}}
    yield Doubt("even", text, "times spread evenly", proposed=YES, of=column.meant, changes=changes, rows=True)


def _groups(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Columns of whole numbers of which some have a mark before three digits: 850 and 1.050."""
    for column in found.measured:
        cells = [cell.strip() for cell in raw.columns[column.name] if cell.strip()]
        # What was a number in its file is the number that stands there.
        texts = cells if raw.texts is None else [cell for cell in cells if cell in raw.texts]
        marked = [cell for cell in texts if MARK_BEFORE_THREE.fullmatch(cell)]
        whole = [cell for cell in cells if WHOLE.fullmatch(cell) and cell.strip("+-0")]
        others = [cell for cell in cells if not MARK_BEFORE_THREE.fullmatch(cell) and not WHOLE.fullmatch(cell)]
        if raw.style == POINTS and marked and whole and not others:
            text = f"Column {column.name!r} has {marked[0]!r} beside {whole[0]!r}. Which number is the first?"
            thousand = marked[0].replace(".", "")
            options = (("thousands", thousand), ("decimals", f"{float(marked[0]):g}, as it stands there"))
            changes = {"thousands": {"read": {"thousands": ".", "decimal": ","}}}
            yield Doubt("read", text, f"{marked[0]!r} is", options, of=column.meant, changes=changes, rows=True)
            return


def _gaps(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """Blanks in what was set: a value that stands once for the rows below it, or rows without one."""
    for column in found.measured:
        if column.column not in (*STATE, *DESIGN):
            continue
        blank = np.isnan(numbers(raw.columns[column.name], raw.style).values)
        if not blank.any() or blank.all():
            continue
        text = f"Column {column.name!r} is blank on line {few([raw.lines[row] for row in np.flatnonzero(blank)])}. "
        between = _between(raw, found, column, blank)
        options: tuple[tuple[str, str], ...] = (
            ("rows", "unknown: leave those rows out"),
            ("above", "as in the row above"),
        )
        options += (("between", "between the readings before and after, by the time"),) if between else ()
        # Many blanks below each value are a table as people write it.
        likely = "above" if not blank[0] and 2 * blank.sum() > len(blank) else None
        # Of a log whose channels have rows of their own none stands for those below it.
        likely = "between" if between and _apart(raw, found, blank) else likely
        above = {"columns": {column.column: {"fill": "above"}}}
        changes: dict[str, Mapping[str, Any]] = {"rows": {"drop": [{column.name: "blank"}]}, "above": above}
        changes |= {"between": {"between": {column.column: between}}} if between else {}
        short = f"blanks of {column.name!r}"
        key = f"gaps.{column.name}"
        yield Doubt(key, text + "What is it there?", short, options, likely, column.meant, changes, rows=True)


def _between(raw: RawTable, found: Guess, column: ColumnGuess, blank: np.ndarray) -> float | None:
    """The longest gap between readings of a channel that a straight line may bridge [s]; None where they have no time
    whose unit is known. blank: where the channel has no reading, (N,) bool."""
    clock = found.of("time_s")
    if clock is None or found.clocks or column.name in found.pressures or column.column not in STATE:
        return None
    time = time_of(raw, clock)
    if time is None or not (clock.dates or clock.unit) or not np.isfinite(time).all():
        return None
    steps = np.diff(time[~blank])
    if len(steps) < LEAST_READINGS or steps.min() <= 0:
        return None
    return float(f"{GAP * (1.0 if clock.dates else conversion(clock.unit, 's').factor) * np.median(steps):.3g}")


def _apart(raw: RawTable, found: Guess, blank: np.ndarray) -> bool:
    """Whether a channel is mostly blank where the loads were read. blank: where it is, (N,) bool."""
    reads = [raw.most_numbers(c.name) for c in found.measured if c.column in READINGS]
    there = np.isfinite([values for values in reads if values is not None]).any(axis=0)
    return bool(there.any()) and float(blank[there].mean()) > 0.5


def _plateaus(raw: RawTable, found: Guess) -> Iterator[Doubt]:
    """A log of places in which the rig stood still."""
    if found.of("time_s") is None or len(raw) < LEAST_ROWS_OF_A_LOG:
        return
    columns, allowed = {}, {}
    imposed = [c for c in found.measured if c.column in STATE and MEANINGS[c.quantity or ""].kind != "ratio"]
    for column in imposed:
        values = raw.most_numbers(column.name)
        if values is not None and not np.isnan(values).any() and np.ptp(values) > 0:
            columns[column.name], allowed[column.name] = values, STEADY * float(np.ptp(values))
    if not columns:
        return
    places = find_plateaus(columns, allowed, LEAST_READINGS)
    count = int(places.max()) + 1
    if count < LEAST_PLATEAUS or (places >= 0).mean() < ON_PLATEAUS:
        return
    of = {found.table_column(c): in_units_of(c.column, c.unit, allowed[c.name]) for c in imposed if c.name in columns}
    text = f"The file is a log of {len(raw)} rows, most of them in {count} places where it stood still. Average each?"
    names = {name: meaning for c in imposed for name, meaning in c.meant.items()}
    changes = {YES: {"plateaus": {"of": of, "settle": 2, "least": LEAST_READINGS - 2}}}
    yield Doubt(PLATEAUS, text, "places averaged", proposed=YES, of=names, changes=changes, rows=True)
