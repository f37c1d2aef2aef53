"""The best guess at what a laboratory's file holds; a guess is shown and drafted, never applied."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.files import read_bytes
from freelearn.data.beds import BEDS
from freelearn.data.intake.guesses.clocks import CHANNELS, clocks_in_words, clocks_of, log_of, of_one_clock, with_times
from freelearn.data.intake.guesses.guessed import ColumnGuess, Doubt, Guess
from freelearn.data.intake.guesses.meanings import HELD, MEANINGS, OUTER_DIAMETER
from freelearn.data.intake.guesses.reading_doubts import pressure_doubts, reading_doubts
from freelearn.data.intake.guesses.row_doubts import cell_doubts, row_doubts, sums
from freelearn.data.intake.headings import INNER_DIAMETER, RUN, Confidence, heading
from freelearn.data.intake.laboratory_units import in_units_of
from freelearn.data.intake.readers.cells import is_date, number_styles, numbers
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.recipes.recipe import DESIGN, MARKS, READINGS, STATE, Reading
from freelearn.data.intake.suspicious import SCATTERED, raw_suspicions, without_sums

ORDER: tuple[Confidence, ...] = ("sure", "likely", "unsure")
# What a heading says that the table has only after a conversion, in the order in which one stands in for the others.
LENGTHS = ("elongation_mm", "shortening", HELD, "stretch", "strain", "contraction")
# More words than this name no actuators.
MOST_SAMPLES = 50
# A further column of the same name is read as NAME [2]; a unit in brackets is none.
AGAIN = re.compile(r" \[\d+\]$")
# The same readings in another unit differ by so much of the largest, as they were rounded.
ROUNDED = 2e-3
# What a column of marks holds.
MARKED = {"0", "1", "0.0", "1.0", ""}


def guess(source: bytes | Path, name: str = "", reading: Reading | None = None) -> Guess:
    """The guess for a file, given as bytes with its name, or as a path. Raises UserError where it cannot be read."""
    if isinstance(source, Path):
        return guess_table(raw_table(read_bytes(source), name or source.name, reading))
    return guess_table(raw_table(source, name, reading))


def guess_table(raw: RawTable, said: Mapping[str, str] | None = None) -> Guess:
    """The guess for a table that was read. said: of columns, name → a key of MEANINGS, or NOT_USED."""
    columns = _columns(raw)
    first = with_meanings(Guess(raw.name, len(raw), "", tuple(columns), (), raw.notes), {})
    found = replace(with_meanings(first, said) if said else first, rivals=tuple(_rivals(raw, first)))
    found = replace(found, notes=(*raw.notes, *_notes(raw, found)), about=raw.about, **several_actuators(raw, found))
    kept = without_sums(raw)
    found = replace(found, order_by=order_wanted(kept, found), log=log_of(kept, found))
    return replace(found, doubts=tuple(_doubts(raw, kept, found)))


def _columns(raw: RawTable) -> list[ColumnGuess]:
    """What the columns say, those of tables that were laid side by side each beside their own."""
    if not raw.pieces:
        return with_times(raw, _told_apart(raw, [column_guess(raw, name) for name in raw.columns]))
    columns = []
    for piece in raw.pieces:
        wide = {own: name for name, own in piece.names.items()}
        for one in _columns(piece.table):
            name, clock = wide[one.name], wide.get(one.clock, "")
            source = one.name if name != one.name else ""
            columns.append(replace(one, name=name, clock=clock, place=piece.place, source=source))
    return columns


def _notes(raw: RawTable, found: Guess) -> list[str]:
    """What looks wrong in the columns, those of each clock by themselves, and what goes by which."""
    measured = [quantity.column for quantity in BEDS[found.bed].measured]
    readings = [c.name for c in found.columns if c.chosen and c.quantity in measured]
    if not found.clocks:
        # Where it begins anew is asked about.
        said = raw_suspicions(raw, readings, None, sums=False)
        if found.pressures and clocks_of(found.columns, found.bed, ()):
            said.append(
                f"{raw.name}: the pressures {', '.join(map(repr, found.pressures))} go by several clocks, and those of "
                "several actuators are not joined: bring them to one clock first, or keep one."
            )
        return said
    said = [f"{raw.name}: {clocks_in_words(found, found.clocks)}."]
    for clock in found.clocks:
        own, _ = of_one_clock(raw, found, clock)
        stamps = None if found.named(clock.time).dates else clock.time
        said += raw_suspicions(own, [name for name in readings if name in clock.channels], stamps, sums=False)
    return list(dict.fromkeys(said))


def _doubts(raw: RawTable, kept: RawTable, found: Guess) -> Iterator[Doubt]:
    """kept: the rows that are readings."""
    yield from sums(raw)
    if not found.clocks:
        yield from row_doubts(kept, found)
        yield from reading_doubts(kept, found)
        return
    lead, *others = (of_one_clock(kept, found, clock) for clock in found.clocks)
    yield from row_doubts(*lead)
    yield from reading_doubts(*lead)
    for (own, of), clock in zip(others, found.clocks[1:], strict=True):
        only = replace(of, columns=tuple(c for c in of.columns if c.name in (clock.time, *clock.channels)))
        yield from cell_doubts(own, only)
        yield from pressure_doubts(own, only)


def with_meanings(found: Guess, said: Mapping[str, str]) -> Guess:
    """The guess once somebody has said what columns are: name → a key of MEANINGS, or NOT_USED; of the others the one
    that says a quantity most clearly is chosen. Doubts about other meanings are gone."""
    columns = [
        replace(c, quantity=said[c.name] if said[c.name] in MEANINGS else None, confidence="sure")
        if c.name in said
        else c
        for c in found.columns
    ]
    pressures = _pressures(columns, said)
    chosen = _chosen(columns, pressures, said)
    columns = [replace(c, chosen=c.name in chosen or c.name in pressures) for c in columns]
    bed = _bed({c.quantity for c in columns if c.chosen})
    clocks = clocks_of(columns, bed, pressures)
    if clocks:
        times = [clock.time for clock in clocks]
        # What is no channel is read from the rows of the first clock.
        place, joined = next(c.place for c in columns if c.name == times[0]), (*CHANNELS, RUN)
        columns = [
            replace(c, chosen=c.name in times if c.is_clock else c.chosen and (c.place == place or c.column in joined))
            for c in columns
        ]
    known = {c.name: c.quantity for c in columns if c.chosen}
    left = tuple(d for d in found.doubts if all(known.get(name) == meaning for name, meaning in d.of.items()))
    return replace(found, columns=tuple(columns), pressures=pressures, bed=bed, doubts=left, clocks=clocks)


def column_guess(raw: RawTable, name: str) -> ColumnGuess:
    """What one column says by itself."""
    said = heading(name, raw.units.get(name, ""))
    example = next((cell.strip() for cell in raw.columns[name] if cell.strip()), "")
    read = numbers(raw.columns[name], raw.style)
    finite = read.values[~np.isnan(read.values)]
    # Some cells that are none, dates for instance, are told by their lines when the column is read; what numbers with
    # marks between groups of digits say is asked.
    grouped = number_styles([raw.columns[name][row].strip() for row in read.bad]) if read.bad else []
    finite = finite if len(read.bad) < len(finite) or grouped else np.zeros(0)
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (np.nan, np.nan)
    if said.quantity == "stretch" and not said.unit and not 0.2 < low <= high < 5:
        # No ratio of lengths: an elongation, whose unit is asked for.
        said = replace(said, quantity="elongation_mm", confidence="likely")
    if said.quantity in ("contraction", "shortening") and high <= 0:
        # It is written as an elongation, which is negative here.
        said = replace(said, quantity={"contraction": "strain", "shortening": "elongation_mm"}[said.quantity])
    usable = len(finite) > 0 or said.quantity in ("sample", RUN)
    words = tuple(dict.fromkeys(word for word in raw.text(name) if word))
    few_words = words if len(words) <= MOST_SAMPLES and (len(finite) == 0 or said.quantity in ("sample", RUN)) else ()
    quantity = said.quantity if usable else None
    return ColumnGuess(
        name, quantity, said.unit, said.confidence, example, low, high, words=few_words, signal=said.signal
    )


def _told_apart(raw: RawTable, columns: Sequence[ColumnGuess]) -> list[ColumnGuess]:
    """The columns, where those of one name may be two things: beside an elongation a length that each sample has one of
    is the unloaded one, else it was held; a radius that changes is no design, and what is not 0 or 1 no mark; a
    diameter that stays the same is no reading."""
    sample = next((raw.text(c.name) for c in columns if c.quantity == "sample"), [""] * len(raw))
    elongated = any(c.column == "elongation_mm" for c in columns)
    out = []
    for column in columns:
        quantity = column.quantity
        each = set(zip(sample, raw.text(column.name), strict=True))
        if quantity == "outer_diameter_mm" and len(each) == len(set(sample)):
            quantity = OUTER_DIAMETER
        if column.column in DESIGN and len(each) > len(set(sample)):
            quantity = HELD if quantity == "length_mm" else None
        if quantity == "length_mm" and not elongated:
            quantity = HELD
        if quantity == RUN and not _names_recordings(raw.text(column.name)):
            quantity = None
        if quantity in MARKS and not set(raw.text(column.name)) <= MARKED:
            quantity = None
        out.append(replace(column, quantity=quantity))
    return out


def _names_recordings(words: Sequence[str]) -> bool:
    """Whether words name several recordings of several rows each, one after the other."""
    changes = sum(one != other for one, other in pairwise(words))
    kinds = set(words)
    return (
        1 < len(kinds) <= MOST_SAMPLES
        and "" not in kinds
        and changes == len(kinds) - 1
        and 2 * len(kinds) <= len(words)
    )


def _pressures(columns: Sequence[ColumnGuess], said: Mapping[str, str]) -> tuple[str, ...]:
    """Columns of pressures that differ: those of several members, if their headings and unit have one form."""
    found = [c for c in columns if c.quantity == "pressure_kpa" and not AGAIN.search(c.name)]
    told = [c for c in found if c.name in said]
    if len(told) > 1:
        return tuple(c.name for c in told)
    found = [c for c in found if c.confidence == "sure" or any(map(str.isdigit, c.name))]
    forms = {"".join(x for x in c.name if not x.isdigit()).replace("m", "").lower() for c in found}
    return tuple(c.name for c in found) if len(found) > 1 and len(forms) == 1 and not told else ()


def _chosen(columns: Sequence[ColumnGuess], pressures: tuple[str, ...], said: Mapping[str, str]) -> set[str]:
    """For each column of the table the one of the file that says it most clearly: what somebody said, else the surest;
    of equals, one with readings that differ, then the first."""
    best: dict[str, ColumnGuess] = {}
    for column in columns:
        if not column.column or (column.quantity == "pressure_kpa" and pressures):
            continue
        rank = _rank(column, said)
        if column.column not in best or rank < _rank(best[column.column], said):
            best[column.column] = column
    return {column.name for column in best.values()}


def _rivals(raw: RawTable, found: Guess) -> Iterator[tuple[str, ...]]:
    """For each column chosen of equals: it and the others, as far as their readings differ."""
    for column in found.columns:
        if not column.chosen or column.name in found.pressures or column.column not in (*STATE, *READINGS):
            continue
        alike = [
            c.name
            for c in found.columns
            if _rank(c, {}) == _rank(column, {}) and c.column == column.column and c.quantity == column.quantity
            if not _same_readings(raw, c, column)
        ]
        if alike:
            yield (column.name, *alike)


def _same_readings(raw: RawTable, *columns: ColumnGuess) -> bool:
    """Whether two columns hold the same numbers, be it in two units."""
    kinds = [MEANINGS[c.quantity or ""].kind for c in columns]
    told = [
        in_units_of(c.column, c.unit, 1.0) if kind != "ratio" else 1.0 for c, kind in zip(columns, kinds, strict=True)
    ]
    one, other = (
        factor * numbers(raw.columns[c.name], raw.style).values for factor, c in zip(told, columns, strict=True)
    )
    scale = np.nanmax(np.abs(one), initial=0.0)
    return bool(np.allclose(one, other, rtol=0, atol=ROUNDED * scale, equal_nan=True))


def _rank(column: ColumnGuess, said: Mapping[str, str]) -> tuple[bool, int, int, bool]:
    # A radius before a diameter, an elongation before what only becomes one.
    derived = LENGTHS.index(column.quantity) if column.quantity in LENGTHS else column.quantity == INNER_DIAMETER
    first = (column.name not in said, int(derived))
    # A time in seconds before one of dates.
    return (first[0], first[1] + column.dates, ORDER.index(column.confidence), column.low == column.high)


def _bed(quantities: set[str | None]) -> str:
    if "outer_diameter_mm" in quantities:
        return "inflation"
    if "moment_nmm" in quantities and "force_n" not in quantities:
        return "dead_load"
    if "force_n" in quantities and "moment_nmm" not in quantities:
        return "isometric"
    return "kinematic" if "force_n" in quantities else "dead_load"


def several_actuators(raw: RawTable, found: Guess) -> dict[str, Any]:
    """The words of the column that says which actuator a row is of, or a column that may say so."""
    column = found.of("sample")
    if column is not None:
        return {"samples": column.words}
    for other in found.columns:
        words = raw.text(other.name)
        kinds = set(words) - {""}
        text = (not other.chosen or other.quantity == RUN) and not other.numeric and not any(map(is_date, kinds))
        # Each word in several rows: no remarks.
        if text and 2 <= len(kinds) <= MOST_SAMPLES and min(words.count(word) for word in kinds) > 1:
            named = tuple(dict.fromkeys(word for word in words if word))
            return {"perhaps": other.name, "perhaps_words": named}
    return {}


def order_wanted(raw: RawTable, found: Guess) -> tuple[str, ...]:
    """Columns to order by, () where the rows of a state stand together: of rows sorted by pressure they do not."""
    pressure, time = found.of("pressure_kpa"), found.of("time_s")
    state = [c for q in (*LENGTHS, "twist_deg") if (c := found.of(q)) is not None]
    sample = found.of("sample")
    if pressure is None or time is not None or not state or found.bed == "dead_load":
        return ()
    values = raw.most_numbers(pressure.name)
    keys = pd.DataFrame({c.name: raw.text(c.name) for c in [*([sample] if sample else []), *state]})
    runs = int((keys != keys.shift()).any(axis=1).sum())
    if values is None or runs <= SCATTERED * len(keys.drop_duplicates()) or not _rises(values, keys, sample):
        return ()
    return tuple(keys.columns)


def _rises(values: np.ndarray, keys: pd.DataFrame, sample: ColumnGuess | None) -> bool:
    """Whether the pressure never falls, in the rows of each actuator."""
    parts = [values] if sample is None else [values[g.index] for _, g in keys.groupby(sample.name)]
    return all((np.diff(part[~np.isnan(part)]) >= 0).all() for part in parts)
