"""From a laboratory's files and a recipe to the rows of a measurement table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.beds import BEDS
from freelearn.measurements.intake.assemble import Intake, assembled
from freelearn.measurements.intake.chosen_rows import chosen_rows
from freelearn.measurements.intake.designs import with_designs
from freelearn.measurements.intake.evaluate import Evaluation
from freelearn.measurements.intake.plateaus import over_plateaus
from freelearn.measurements.intake.quantities import at_rest, quantities
from freelearn.measurements.intake.raw_file import raw_table
from freelearn.measurements.intake.recipe import Part, Recipe
from freelearn.measurements.intake.samples import constants_by_row, sample_numbers
from freelearn.measurements.intake.suspicious import raw_suspicions, table_suspicions


@dataclass
class Tally:
    """What happened to the rows, file by file, and what is to be said about them."""

    files: list[dict[str, Any]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def convert(recipe: Recipe, sources: Mapping[str, bytes], designs: bytes | None = None) -> Intake:
    """The table that a recipe makes of files. sources: name → bytes: one file, or those that the recipe lists. designs:
    the file of the actuators' designs, where the recipe has one.

    Raises UserError where something in them cannot be turned into what the bed's table needs. Nothing is read from disk
    and nothing executed.
    """
    recipe = with_designs(recipe, sources, designs)
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
    raw = chosen_rows(recipe, part, raw)
    readings = [raw.known(columns[q.column].source) for q in BEDS[recipe.bed].measured if q.column in columns]
    time = raw.known(columns["time_s"].source) if "time_s" in columns else None
    tally.warnings += [*raw.notes, *raw_suspicions(raw, readings, time)]
    numbers, sample_names = sample_numbers(part.sample or recipe.sample, raw)
    rows = Evaluation(raw, columns, constants_by_row(recipe, part, numbers), numbers)
    rows.rest = at_rest(recipe, rows)
    table = quantities(recipe, rows)
    chosen = len(table)
    table, between = over_plateaus(recipe, table)
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
