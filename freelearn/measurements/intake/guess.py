"""The best guess at what a laboratory's file holds; a guess is shown and drafted, never applied."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.cells import numbers
from freelearn.measurements.intake.headings import INNER_DIAMETER, Confidence, heading
from freelearn.measurements.intake.raw_file import raw_table
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.reading import Reading
from freelearn.measurements.intake.recipe import DESIGN, MARKS
from freelearn.measurements.intake.suspicious import SCATTERED, raw_suspicions
from freelearn.measurements.text_file import read_bytes

ORDER: tuple[Confidence, ...] = ("sure", "likely", "unsure")
# A length that was held: the table's own is the unloaded one.
HELD = "held_length"
# What a heading says that the table has only after a conversion.
LENGTHS = ("elongation_mm", HELD, "stretch", "strain")
# More words than this name no actuators.
MOST_SAMPLES = 50
# What a column of marks holds.
MARKED = {"0", "1", "0.0", "1.0", ""}


@dataclass(frozen=True)
class ColumnGuess:
    """quantity: of the table, held_length, stretch or strain; None: none known. unit: as written, "" where the heading
    says none. example: the first reading. low, high: the range, NaN for texts. chosen: whether the draft takes it."""

    name: str
    quantity: str | None
    unit: str
    confidence: Confidence
    example: str
    low: float
    high: float
    chosen: bool = False


@dataclass(frozen=True)
class Guess:
    """What a file seems to hold. bed: the one that fits these columns. pressures: names of the columns that are
    members' pressures, where there are several. notes: how the file was read and what looks wrong in it."""

    name: str
    rows: int
    bed: str
    columns: tuple[ColumnGuess, ...]
    pressures: tuple[str, ...]
    notes: tuple[str, ...]
    # Of which actuator the rows are: the words of the column that says so, in their order.
    samples: tuple[str, ...] = ()
    # A column that may say so, although its heading does not.
    perhaps: str = ""
    perhaps_words: tuple[str, ...] = ()
    # Columns by which the rows of one state come to stand together, where they lie sorted by pressure.
    order_by: tuple[str, ...] = ()
    # Of a workbook with several.
    sheet: str = ""

    def of(self, quantity: str) -> ColumnGuess | None:
        """The column chosen for a quantity."""
        return next((c for c in self.columns if c.chosen and c.quantity == quantity), None)


def guess(source: bytes | Path, name: str = "", reading: Reading | None = None) -> Guess:
    """The guess for a file, given as bytes with its name, or as a path. Raises UserError where it cannot be read."""
    if isinstance(source, Path):
        return guess_table(raw_table(read_bytes(source), name or source.name, reading))
    return guess_table(raw_table(source, name, reading))


def guess_table(raw: RawTable) -> Guess:
    """The guess for a table that was read."""
    columns = _told_apart(raw, [column_guess(raw, name) for name in raw.columns])
    pressures = _pressures(columns)
    chosen = _chosen(columns, pressures)
    columns = [replace(c, chosen=c.name in chosen or c.name in pressures) for c in columns]
    quantities = {c.quantity for c in columns if c.chosen}
    time = next((c.name for c in columns if c.chosen and c.quantity == "time_s"), None)
    bed = _bed(quantities)
    measured = [quantity.column for quantity in BEDS[bed].measured]
    readings = [c.name for c in columns if c.chosen and c.quantity in measured]
    notes = [*raw.notes, *raw_suspicions(raw, readings, time)]
    found = Guess(raw.name, len(raw), bed, tuple(columns), pressures, tuple(notes))
    return replace(found, **several_actuators(raw, found), order_by=order_wanted(raw, found))


def column_guess(raw: RawTable, name: str) -> ColumnGuess:
    """What one column says by itself."""
    said = heading(name, raw.units.get(name, ""))
    example = next((cell.strip() for cell in raw.columns[name] if cell.strip()), "")
    read = numbers(raw.columns[name], raw.style)
    finite = read.values[~np.isnan(read.values)]
    # Some cells that are none, dates for instance, are told by their lines when the column is read.
    finite = finite if len(read.bad) < len(finite) else np.zeros(0)
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (np.nan, np.nan)
    if said.quantity == "stretch" and not said.unit and not 0.2 < low <= high < 5:
        # No ratio of lengths: an elongation, whose unit is asked for.
        said = replace(said, quantity="elongation_mm", confidence="likely")
    usable = len(finite) > 0 or said.quantity == "sample"
    return ColumnGuess(name, said.quantity if usable else None, said.unit, said.confidence, example, low, high)


def _told_apart(raw: RawTable, columns: Sequence[ColumnGuess]) -> list[ColumnGuess]:
    """The columns, where those of one name may be two things: beside an elongation a length that each sample has one of
    is the unloaded one, else it was held; a radius that changes is no design, and what is not 0 or 1 no mark."""
    sample = next((raw.text(c.name) for c in columns if c.quantity == "sample"), [""] * len(raw))
    elongated = any(c.quantity == "elongation_mm" for c in columns)
    out = []
    for column in columns:
        quantity = column.quantity
        if quantity in DESIGN and len(set(zip(sample, raw.text(column.name), strict=True))) > len(set(sample)):
            quantity = HELD if quantity == "length_mm" else None
        if quantity == "length_mm" and not elongated:
            quantity = HELD
        if quantity in MARKS and not set(raw.text(column.name)) <= MARKED:
            quantity = None
        out.append(replace(column, quantity=quantity))
    return out


def _pressures(columns: Sequence[ColumnGuess]) -> tuple[str, ...]:
    """Columns of pressures that differ: those of several members, if their headings and unit have one form."""
    found = [c for c in columns if c.quantity == "pressure_kpa" and c.confidence == "sure" and not c.name.endswith("]")]
    forms = {"".join(x for x in c.name if not x.isdigit()).replace("m", "").lower() for c in found}
    return tuple(c.name for c in found) if len(found) > 1 and len(forms) == 1 else ()


def _chosen(columns: Sequence[ColumnGuess], pressures: tuple[str, ...]) -> set[str]:
    """For each quantity the column that says it most clearly; of equals, one with readings that differ, then the
    first. Length, stretch and strain stand in for the elongation."""
    best: dict[str, ColumnGuess] = {}
    for column in columns:
        if column.quantity is None or (column.quantity == "pressure_kpa" and pressures):
            continue
        rank = _rank(column)
        if column.quantity not in best or rank < _rank(best[column.quantity]):
            best[column.quantity] = column
    for quantity in [q for q in LENGTHS if q in best][1:]:
        del best[quantity]
    if "inner_radius_mm" in best:
        best.pop(INNER_DIAMETER, None)
    return {column.name for column in best.values()}


def _rank(column: ColumnGuess) -> tuple[int, bool]:
    return ORDER.index(column.confidence), column.low == column.high


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
        return {"samples": tuple(dict.fromkeys(word for word in raw.text(column.name) if word))}
    for other in found.columns:
        words = raw.text(other.name)
        kinds = set(words) - {""}
        text = not other.chosen and other.low != other.low
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
    values = raw.maybe_numbers(pressure.name)
    keys = pd.DataFrame({c.name: raw.text(c.name) for c in [*([sample] if sample else []), *state]})
    runs = int((keys != keys.shift()).any(axis=1).sum())
    if values is None or runs <= SCATTERED * len(keys.drop_duplicates()) or not _rises(values, keys, sample):
        return ()
    return tuple(keys.columns)


def _rises(values: np.ndarray, keys: pd.DataFrame, sample: ColumnGuess | None) -> bool:
    """Whether the pressure never falls, in the rows of each actuator."""
    parts = [values] if sample is None else [values[g.index] for _, g in keys.groupby(sample.name)]
    return all((np.diff(part[~np.isnan(part)]) >= 0).all() for part in parts)
