"""The quantities of one file's rows, and every column of the table, as a recipe makes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.columns import pressure_column
from freelearn.data.intake.chosen_rows import meets
from freelearn.data.intake.laboratory_units import ABSOLUTE, conversion, unit_of
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.readers.stamps import spread_evenly
from freelearn.data.intake.recipes.recipe import DATE, Column, Condition, Recipe, Term


def apply_corrections(name: str, column: Column, raw: np.ndarray, record: dict[str, Any]) -> np.ndarray:
    """A column's readings (N,) with those put right. name: of the file. record: tells what was done.

    Raises UserError where nothing reads what is to be corrected.
    """
    if not column.correct:
        return raw
    right = raw.copy()
    for wrong, value in column.correct:
        if not (raw == wrong).any():
            raise UserError(f"{name}: column {column.source!r} nowhere reads {wrong:g}, which the recipe corrects.")
        right[raw == wrong] = value
    record["corrected"] = {f"{wrong:g}": value for wrong, value in column.correct}
    return right


def term_to_dict(term: Term) -> Any:
    """A term as plain values."""
    if term.number is not None:
        return term.number
    if term.thrust_on is not None:
        return {"pressure_on": term_to_dict(term.thrust_on)}
    return term.column if term.column is not None else {"from": term.source, "unit": term.unit}


# No bed imposes or reads more in the table's units; beyond it float64 still counts, but something slipped.
LARGEST = 1e12


@dataclass
class Evaluation:
    """Quantities of the rows of a file, each made once and kept with how it was made.

    raw: the rows. columns: of the recipe. constants: (N,) each. sample: (N,) int64. rest: rows at rest, None where the
    recipe has none. made: column → (N,) float64 in the table's unit. records: column → how, plain values. notes.
    words: texts that were joined from elsewhere, N each.
    """

    raw: RawTable
    columns: Mapping[str, Column]
    constants: Mapping[str, np.ndarray]
    sample: np.ndarray
    rest: np.ndarray | None = None
    made: dict[str, np.ndarray] = field(default_factory=dict)
    records: dict[str, dict[str, Any]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    words: dict[str, list[str]] = field(default_factory=dict)
    _making: list[str] = field(default_factory=list)

    def quantity(self, name: str) -> np.ndarray:
        """A column of the table, (N,) float64. Raises UserError where it is not given, or needs itself."""
        if name in self.made:
            return self.made[name]
        if name in self.constants:
            return self.constants[name]
        if name not in self.columns:
            raise UserError(
                f"{self.raw.name}: the recipe uses {name}, but gives it nowhere: add it to columns or constants."
            )
        if name in self._making:
            raise UserError(f"{name} of the recipe needs itself, by {' → '.join([*self._making, name])}: untie them.")
        self._making.append(name)
        self.made[name] = self.make(name, self.columns[name])
        self._making.pop()
        return self.made[name]

    def make(self, name: str, column: Column) -> np.ndarray:
        """The quantity that a column of the recipe says, recorded under `name`."""
        raw = self.read(column)
        record: dict[str, Any] = {"from": self.raw.known(column.source), "unit": column.unit}
        if column.fill == "above":
            raw, record["filled"] = _as_above(raw), {"with": "above", "cells": int(np.isnan(raw).sum())}
        raw = apply_corrections(self.raw.name, column, raw, record)
        change = conversion("s" if column.unit == DATE else column.unit, "" if column.times else unit_of(name))
        offset = self._offset(column, raw, record)
        values = change.factor * column.sign * column.scale * (raw - offset) + change.shift
        record |= {"to": unit_of(name), "factor": change.factor, "shift": change.shift}
        record |= {"sign": column.sign, "scale": column.scale}
        if column.times:
            values = values * self.quantity(column.times)
            record["times"] = column.times
        if column.even:
            values, record["even"] = self._evenly(column, values), True
        for key, sign, terms in (("plus", 1.0, column.plus), ("minus", -1.0, column.minus)):
            for term in terms:
                values = values + sign * self._term(term, name)
                record.setdefault(key, []).append(term_to_dict(term))
        self._blanks(name, column, values, record)
        self._check_size(name, values)
        if column.unit.strip().lower() in ABSOLUTE and not column.minus:
            self.notes.append(
                f"{name}: {column.unit} is absolute, and the table wants gauge pressure: add minus: 101.325."
            )
        for word, count in self.raw.words(column.source).items():
            cells = "1 cell holds" if count == 1 else f"{count} cells hold"
            self.notes.append(f"{self.raw.name}, column {column.source!r}: {cells} {word!r}, read as blank.")
        self.records[name] = record
        return values + 0.0  # Turns -0.0 into 0.0.

    def read(self, column: Column) -> np.ndarray:
        """The cells of a column as numbers, dates as seconds, (N,). Raises UserError."""
        read = self.raw.seconds if column.unit == DATE else self.raw.numbers
        return read(column.source, column.blanks)

    def _evenly(self, column: Column, time: np.ndarray) -> np.ndarray:
        """A rounded time as that of rows that were taken evenly. Raises UserError."""
        spread = spread_evenly(time) if np.isfinite(time).all() else None
        if spread is None:
            raise UserError(
                f"{self.raw.name}: column {column.source!r} is no rounded time of rows that were taken evenly: leave "
                "out even:, and export it with more digits."
            )
        return spread

    def _offset(self, column: Column, raw: np.ndarray, record: dict[str, Any]) -> np.ndarray | float:
        if column.offset != "rest":
            record["offset"] = column.offset
            return column.offset
        assert self.rest is not None
        offsets = np.full(len(raw), np.nan)
        found: dict[str, float] = {}
        for number in np.unique(self.sample):
            of = self.sample == number
            at_rest = raw[of & self.rest]
            if not np.isfinite(at_rest).any():
                raise UserError(
                    f"{self.raw.name}: no row of sample {number} is at rest with a reading of {column.source!r}: "
                    "correct rest:."
                )
            found[str(number)] = float(np.nanmean(at_rest))
            offsets[of] = found[str(number)]
        record |= {"offset": found, "offset_of": "rest"}
        return offsets

    def _term(self, term: Term, name: str) -> np.ndarray:
        """A term in the unit of the column `name`, (N,)."""
        if term.number is not None:
            return np.full(len(self.raw), term.number)
        if term.column is not None:
            return self.quantity(term.column)
        if term.thrust_on is not None:
            radius_mm = self._term(term.thrust_on, "radius_mm")
            return np.asarray(np.pi * (1e-3 * radius_mm) ** 2 * 1e3 * self.quantity("pressure_kpa"))
        assert term.source is not None
        change = conversion(term.unit, unit_of(name))
        return change.factor * self.raw.numbers(term.source) + change.shift

    def _blanks(self, name: str, column: Column, values: np.ndarray, record: dict[str, Any]) -> None:
        if column.blank_where:
            blanked = self.where(column.blank_where)
            values[blanked] = np.nan
            record["blanked"] = int(blanked.sum())
        if isinstance(column.fill, float):
            blank = np.isnan(values)
            values[blank] = column.fill
            record["filled"] = {"with": column.fill, "cells": int(blank.sum())}

    def where(self, condition: Condition) -> np.ndarray:
        """Rows that meet a condition on columns of the file or of the table, (N,) bool."""
        known = {n: self.quantity(n) for n in condition if n not in self.raw.columns and self._has(n)}
        return meets(condition, self.raw, known)

    def _has(self, name: str) -> bool:
        return name in self.columns or name in self.constants or name in self.made

    def _check_size(self, name: str, values: np.ndarray) -> None:
        huge = np.flatnonzero(np.abs(values) > LARGEST)
        if len(huge):
            line = self.raw.lines[int(huge[0])]
            raise UserError(
                f"{self.raw.name}, line {line}: {name} would be {values[huge[0]]:.3g} {unit_of(name)}, which nothing "
                "measures: correct the cell, or drop the row."
            )


def _as_above(values: np.ndarray) -> np.ndarray:
    """Blanks as the last number above them."""
    place = np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(len(values))))
    return np.asarray(values[place])


# Every column of the table that a recipe makes of one file's rows.

# Columns that rows carry until the table is assembled.
FILE, LINE, ANEW = "file", "line", "anew "
# The name of each row's recording, as the file says it.
NAMED = "recording as named"


def at_rest(recipe: Recipe, rows: Evaluation) -> np.ndarray | None:
    """Rows by which `offset: rest` is measured, (N,) bool; None where the recipe has none."""
    if recipe.rest is None:
        return None
    if recipe.rest == "first":
        first = np.zeros(len(rows.raw), dtype=bool)
        first[np.unique(rows.sample, return_index=True)[1]] = True
        return first
    return rows.where(recipe.rest)


def quantities(recipe: Recipe, rows: Evaluation) -> pd.DataFrame:
    """Every column of the table but the step, in no particular order."""
    columns: dict[str, Any] = {"sample": rows.sample}
    for name in (*rows.columns, *rows.constants):
        columns[name] = rows.quantity(name)
    for number, member in enumerate(recipe.members, start=1):
        name = pressure_column(number)
        rows.made[name] = columns[name] = rows.make(name, member.pressure)
    if recipe.steps.source is not None:
        columns["step"] = rows.raw.numbers(recipe.steps.source)
    for mark, condition in recipe.marks.items():
        columns[mark] = rows.where(condition).astype(np.int64)
    columns |= {f"{ANEW}{name}": rows.raw.text(name) for name in recipe.steps.anew}
    columns |= {_carried(name, columns): rows.raw.text(name) for name in recipe.carry}
    if recipe.run is not None and recipe.run.source is not None:
        columns[NAMED] = rows.words[NAMED] if NAMED in rows.words else rows.raw.text(recipe.run.source)
    return pd.DataFrame(columns | {FILE: rows.raw.name, LINE: rows.raw.lines})


def _carried(name: str, columns: Mapping[str, Any]) -> str:
    if name in columns:
        raise UserError(f"carry: {name!r} is already a column of the table: leave it out of carry.")
    return name
