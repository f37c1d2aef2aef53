"""From a laboratory's files, their designs and a recipe to the rows of a measurement table; and which
recording each row of a log is of, by a column of the file or by where its time begins anew."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.beds import BEDS
from freelearn.data.intake.assemble import Intake, assembled
from freelearn.data.intake.chosen_rows import chosen_rows, constants_by_row, sample_numbers
from freelearn.data.intake.evaluate import FILE, LINE, NAMED, Evaluation, at_rest, quantities
from freelearn.data.intake.joined_channels import with_joined
from freelearn.data.intake.plateaus import over_plateaus
from freelearn.data.intake.readers.cells import few
from freelearn.data.intake.readers.raw_files import raw_table
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.recipes.recipe import Design, Part, Reading, Recipe, Recordings, Sample
from freelearn.data.intake.recipes.recipe_file import needed
from freelearn.data.intake.suspicious import raw_suspicions, still_open, table_suspicions
from freelearn.data.logs import RUN, TIME
from freelearn.data.table.log_tables import jump


def recordings_of(rows: pd.DataFrame, recordings: Recordings) -> tuple[np.ndarray, list[str]]:
    """The recording of each row (N,), numbers from 1 up or the words of the column that says them; and what was found,
    in sentences. rows: of all files in their order. Raises UserError where a time, or a recording's name, is blank."""
    if TIME not in rows:
        raise UserError(f"run needs the time of the rows: add {TIME} to columns of the recipe, or leave run out.")
    _refuse_blank(rows, TIME, rows[TIME].isna().to_numpy(), "its time, or drop the row")
    files = rows[FILE].to_numpy()
    if recordings.source is not None:
        words = rows[NAMED].astype(str).str.strip()
        _refuse_blank(rows, "run", (words == "").to_numpy(), "the recording's name, or drop the row")
        several = len(set(files)) > 1
        return np.asarray(rows[FILE].astype(str) + " " + words if several else words), []
    time, lines = rows[TIME].to_numpy(np.float64), rows[LINE].to_numpy()
    other = (files[1:] != files[:-1]) | (rows["sample"].to_numpy()[1:] != rows["sample"].to_numpy()[:-1])
    starts = [0, *(np.flatnonzero(other) + 1), len(rows)]
    begins = [b for first, end in pairwise(starts) for b in _begins(time[first:end], first)]
    sentences = []
    for name in dict.fromkeys(files):
        anew = [int(lines[b]) for b in begins if files[b] == name and b not in starts]
        if anew:
            where = f"line{'s' if anew[1:] else ''} {few(anew)}"
            sentences.append(
                f"{name}: the time begins anew, or jumps, at {where}: {len(anew) + 1} recordings were made of it."
            )
    run = np.zeros(len(rows), dtype=np.int64)
    run[begins] = 1
    return np.cumsum(run), sentences


def _begins(time: np.ndarray, first: int) -> Iterator[int]:
    """The first row of each recording among rows of one file and one actuator, of which `first` is the first: the time
    falls before it, or jumps as no clock does within a recording."""
    falls = [0, *(np.flatnonzero(np.diff(time) < 0) + 1), len(time)]
    for start, end in pairwise(falls):
        yield from _without_jumps(time[start:end], first + start)


def _without_jumps(time: np.ndarray, first: int) -> Iterator[int]:
    step = np.diff(time)
    at = jump(step) if len(step) else None
    if at is None:
        yield first
        return
    yield from _without_jumps(time[: at + 1], first)
    yield from _without_jumps(time[at + 1 :], first + at + 1)


def _refuse_blank(rows: pd.DataFrame, name: str, blank: np.ndarray, cure: str) -> None:
    if blank.any():
        file, line = rows.loc[np.flatnonzero(blank)[0], [FILE, LINE]]
        raise UserError(f"{file}, line {line}: {name} is blank, and a log's rows have one each: give {cure}.")


# Designs by actuator: a second file, or a sheet of the workbook, joined with the rows by the actuators' names.


def with_designs(recipe: Recipe, sources: Mapping[str, bytes], content: bytes | None = None) -> Recipe:
    """The recipe with the constants of each actuator in place of its `design`. content: of the file of designs; None
    where they are a sheet of the only source. Raises UserError where a design is blank, twice there, or nobody's."""
    design = recipe.design
    if design is None:
        return recipe
    name = design.file or next(iter(sources))
    content = content if content is not None else sources.get(name)
    if content is None:
        raise UserError(f"The file of designs {name} was not given: add design={name} to intake.")
    raw = raw_table(content, name, Reading(sheet=design.sheet or None))
    words = raw.text(design.by)
    raw = raw.rows([row for row, word in enumerate(words) if word])
    words = [word for word in words if word]
    for word in words:
        if words.count(word) > 1:
            raise UserError(
                f"{name}: {word!r} stands {words.count(word)} times in {design.by!r}: keep one row of each."
            )
    numbers = _numbers(recipe, words, name)
    made = _constants(design, raw)
    samples = {
        number: {**recipe.samples.get(number, {}), **{column: float(values[row]) for column, values in made.items()}}
        for row, word in enumerate(words)
        if (number := numbers.get(word)) is not None
    }
    sample = recipe.sample
    if sample.source is not None and sample.numbers is None and not all(word.isdecimal() for word in words):
        sample = Sample(source=sample.source, numbers=numbers)
    return replace(recipe, samples={**recipe.samples, **samples}, sample=sample, design=None)


def _numbers(recipe: Recipe, words: list[str], name: str) -> dict[str, int]:
    """Of each actuator's name its number: the recipe's, else the name where it is one, else its place."""
    if recipe.sample.source is None and not recipe.files:
        raise UserError(
            f"The designs of {name} are joined by the actuators' names: say which column of the data names them, "
            "sample: {from: COLUMN}."
        )
    if recipe.sample.numbers is not None:
        return {word: number for word, number in recipe.sample.numbers.items() if word in words}
    if all(word.removesuffix(".0").isdecimal() for word in words):
        return {word: int(float(word)) for word in words}
    return {word: number for number, word in enumerate(words, start=1)}


def _constants(design: Design, raw: RawTable) -> dict[str, np.ndarray]:
    evaluation = Evaluation(raw, dict(design.columns), {}, np.ones(len(raw), dtype=np.int64))
    made = {column: evaluation.quantity(column) for column in design.columns}
    for column, values in made.items():
        blank = np.flatnonzero(np.isnan(values))
        if len(blank):
            raise UserError(f"{raw.name}, line {raw.lines[int(blank[0])]}: {column} is blank: give it.")
    return made


# From a laboratory's files and a recipe to the rows of a measurement table.


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
    tables = [_rows(recipe, part, sources, tally) for part in parts]
    table = pd.concat(tables, ignore_index=True)
    if not len(table):
        raise UserError("No row is left: look at keep, drop, join and plateaus of the recipe.")
    if recipe.run is not None:
        table[RUN], found = recordings_of(table, recipe.run)
        tally.warnings += found
    intake = assembled(recipe, table, tally.files, _told_once(tally.warnings))
    doubtful = still_open(table_suspicions(intake.table, recipe.bed), recipe.as_read())
    return replace(intake, warnings=tuple(dict.fromkeys([*intake.warnings, *doubtful])))


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
        if len(sources) != 1 + len(set(recipe.joined_files()) - {next(iter(sources))}):
            raise UserError("The recipe is for one file: list several under files:.")
        return [Part(next(iter(sources)))]
    own = next(iter(sources))
    recipe = replace(recipe, files=tuple(replace(part, name=part.name or own) for part in recipe.files))
    lacking = [part.name for part in recipe.files if part.name not in sources]
    if lacking:
        raise UserError(f"The recipe lists {', '.join(lacking)}, and no such file is there: correct files:.")
    return recipe.files


def _rows(recipe: Recipe, part: Part, sources: Mapping[str, bytes], tally: Tally) -> pd.DataFrame:
    """One file's rows with every quantity, mark and carried column."""
    reading = part.reading or recipe.reading
    raw = raw_table(sources[part.name], part.name, reading)
    if [other.name for other in recipe.files if other.name in (part.name, "")][1:]:
        raw = replace(raw, name=part.label)
    whole = len(raw)
    columns = recipe.columns_for(part)
    raw = chosen_rows(recipe, part, raw)
    readings = [raw.known(columns[q.column].source) for q in BEDS[recipe.bed].measured if q.column in columns]
    # Of a log it may begin anew.
    time = raw.known(columns["time_s"].source) if "time_s" in columns and recipe.run is None else None
    tally.warnings += [*raw.notes, *raw_suspicions(raw, readings, time)]
    numbers, sample_names = sample_numbers(part.sample or recipe.sample, raw)
    rows = Evaluation(raw, columns, constants_by_row(recipe, part, numbers), numbers)
    rows, kept, joined = with_joined(recipe.joins_for(part), part, rows, needed(recipe), reading, sources, recipe.run)
    rows.rest = at_rest(recipe, rows)
    table = quantities(recipe, rows)
    chosen = len(table)
    table = table[kept].reset_index(drop=True)
    lost = chosen - len(table)
    table, between = over_plateaus(recipe, table)
    tally.warnings += rows.notes
    tally.files.append(
        {
            "file": raw.name,
            "rows": whole,
            "dropped": whole - chosen,
            **({"joined": joined, "lost_by_joining": lost} if joined else {}),
            "between_plateaus": between,
            "table_rows": len(table),
            "columns": rows.records,
            "samples": sample_names,
            "constants": dict(part.constants),
        }
    )
    return table
