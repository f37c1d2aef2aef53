"""From a laboratory's files and a recipe to the rows of a measurement table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.assemble import Intake, assembled
from freelearn.measurements.intake.conditions import meets
from freelearn.measurements.intake.evaluate import Evaluation
from freelearn.measurements.intake.plateaus import averaged
from freelearn.measurements.intake.raw_file import raw_table
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.recipe import Part, Recipe
from freelearn.measurements.intake.samples import constants_by_row, sample_numbers
from freelearn.measurements.intake.suspicious import raw_suspicions, table_suspicions
from freelearn.measurements.members import pressure_column

# Columns that rows carry until the table is assembled.
FILE, LINE, ANEW = "file", "line", "anew "


@dataclass
class Tally:
    """What happened to the rows, file by file, and what is to be said about them."""

    files: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def convert(recipe: Recipe, sources: Mapping[str, bytes]) -> Intake:
    """The table that a recipe makes of files. sources: name → bytes: one file, or those that the recipe lists.

    Raises UserError where something in them cannot be turned into what the bed's table needs. Nothing is read from disk
    and nothing executed.
    """
    parts = _parts(recipe, sources)
    tally = Tally()
    tables = [_rows(recipe, part, sources[part.name], tally) for part in parts]
    table = pd.concat(tables, ignore_index=True)
    if not len(table):
        raise UserError("No row is left: look at keep, drop and plateaus of the recipe.")
    intake = assembled(recipe, table, tally.files, _told_once(tally.warnings))
    return replace(
        intake, warnings=tuple(dict.fromkeys([*intake.warnings, *table_suspicions(intake.table, recipe.bed)]))
    )


def _told_once(warnings: Sequence[str]) -> list[str]:
    """The same sentence about several files as one about the first."""
    files: dict[str, list[str]] = {}
    for warning in warnings:
        name, colon, sentence = warning.partition(": ")
        files.setdefault(sentence if colon else warning, []).append(name)
    return [
        f"{names[0]}{f' and {len(names) - 1} more' if len(names) > 1 else ''}: {sentence}"
        if names[0] != sentence
        else sentence
        for sentence, names in files.items()
    ]


def _parts(recipe: Recipe, sources: Mapping[str, bytes]) -> Sequence[Part]:
    if not recipe.files:
        if len(sources) != 1:
            raise UserError("The recipe is for one file: list several under files:.")
        return [Part(next(iter(sources)))]
    lacking = [part.name for part in recipe.files if part.name not in sources]
    if lacking:
        raise UserError(f"The recipe lists {', '.join(lacking)}, and no such file is there: correct files:.")
    return recipe.files


def _rows(recipe: Recipe, part: Part, content: bytes, tally: Tally) -> pd.DataFrame:
    """One file's rows with every quantity, mark and carried column."""
    raw = raw_table(content, part.name, part.reading or recipe.reading)
    whole = len(raw)
    columns = recipe.columns_for(part)
    raw = _chosen(recipe, part, raw)
    readings = [raw.known(columns[q.column].source) for q in BEDS[recipe.bed].measured if q.column in columns]
    time = raw.known(columns["time_s"].source) if "time_s" in columns else None
    tally.warnings += [*raw.notes, *raw_suspicions(raw, readings, time)]
    numbers, sample_names = sample_numbers(part.sample or recipe.sample, raw)
    rows = Evaluation(raw, columns, constants_by_row(recipe, part, numbers), numbers)
    rows.rest = _at_rest(recipe, rows)
    table = _quantities(recipe, rows)
    chosen = len(table)
    table, between = _plateaus(recipe, table)
    tally.warnings += rows.notes
    tally.files.append(
        {
            "file": part.name,
            "rows": whole,
            "dropped": whole - chosen,
            "between_plateaus": between,
            "table_rows": len(table),
            "columns": rows.records,
            "samples": sample_names,
        }
    )
    return table


def _chosen(recipe: Recipe, part: Part, raw: RawTable) -> RawTable:
    """The rows that are kept, in the order that the recipe asks for."""
    keep = meets(recipe.keep, raw) if recipe.keep else np.ones(len(raw), dtype=bool)
    for condition in (*recipe.drop, *part.drop):
        keep &= ~meets(condition, raw)
    if not keep.any():
        raise UserError(f"{raw.name}: keep and drop of the recipe leave no row.")
    raw = raw.rows(np.flatnonzero(keep))
    if not recipe.order_by:
        return raw
    keys = pd.DataFrame({str(i): _sortable(raw, name) for i, name in enumerate(recipe.order_by)})
    return raw.rows(keys.sort_values(list(keys), kind="stable").index.to_numpy())


def _sortable(raw: RawTable, name: str) -> np.ndarray | list[str]:
    values = raw.maybe_numbers(raw.known(name))
    return raw.text(name) if values is None else values


def _at_rest(recipe: Recipe, rows: Evaluation) -> np.ndarray | None:
    if recipe.rest is None:
        return None
    if recipe.rest == "first":
        first = np.zeros(len(rows.raw), dtype=bool)
        first[np.unique(rows.sample, return_index=True)[1]] = True
        return first
    return rows.where(recipe.rest)


def _quantities(recipe: Recipe, rows: Evaluation) -> pd.DataFrame:
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
    return pd.DataFrame(columns | {FILE: rows.raw.name, LINE: rows.raw.lines})


def _carried(name: str, columns: Mapping[str, Any]) -> str:
    if name in columns:
        raise UserError(f"carry: {name!r} is already a column of the table: leave it out of carry.")
    return name


def _plateaus(recipe: Recipe, table: pd.DataFrame) -> tuple[pd.DataFrame, int]:
    """The table with its readings averaged, where the recipe asks for it, and how many belong to no plateau."""
    if recipe.plateaus is None:
        return table, 0
    unknown = [name for name in recipe.plateaus.of if name not in table]
    if unknown:
        raise UserError(f"plateaus.of names {unknown[0]}, which the recipe does not make: name one of its columns.")
    measured = [q.column for q in BEDS[recipe.bed].measured if q.column in table]
    words = [name for name in table if not pd.api.types.is_numeric_dtype(table[name])]
    kept = list(dict.fromkeys([*words, "sample", FILE, LINE, *recipe.marks]))
    done = [averaged(part, recipe.plateaus, measured, kept) for _, part in table.groupby("sample", sort=False)]
    result = pd.concat([part for part, _ in done], ignore_index=True)
    if not len(result):
        raise UserError(
            f"{table[FILE].iloc[0]}: no plateau of {recipe.plateaus.least} readings: allow more in plateaus.of, or "
            "fewer readings in least."
        )
    return result, sum(left for _, left in done)
