"""A laboratory's raw file, by a recipe, to a measurement table with its provenance, or to a table of questions."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from freelearn.common.csv_text import csv_text
from freelearn.common.errors import UserError, cannot_write
from freelearn.common.files import read_bytes, remove_unfinished, write_text
from freelearn.data.beds import BEDS
from freelearn.data.intake.assemble import Intake, provenance
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.wanted import Actuators, parse_wanted, questions_table
from freelearn.data.intake.readers.raw_files import is_folder, raw_table, read_sources
from freelearn.data.intake.recipes.recipe import Recipe
from freelearn.data.intake.recipes.recipe_file import content_of, recipe_of, recipe_text
from freelearn.data.intake.suspicious import still_open
from freelearn.data.table.faults import Fault, TableError
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.members_table import read_members

# The files that intake writes: the table, its members and where they came from, all of them or none.

PROVENANCE = "_provenance.json"
MOST_FAULTS = 10


def write_intake(intake: Intake, recipe: Recipe, out: Path, made: dict[str, Any]) -> Sequence[str]:
    """The table, its members and its provenance: all of them, or none. Gives the warnings of reading the table."""
    process = os.getpid()
    # Written under these names, and moved in this order: the table last, for it marks a whole result.
    moved = {
        out.with_name(f".{out.stem}.{process}.members.csv"): beside(out, "_members.csv"),
        out.with_name(f".{out.stem}.{process}.provenance.json"): beside(out, PROVENANCE),
        out.with_name(f".{out.stem}.{process}.part.csv"): out,
    }
    members, told, part = moved
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        remove_unfinished(out.parent)
        try:
            part.write_text(csv_text(intake.table), encoding="utf-8")
            if intake.members is not None:
                members.write_text(csv_text(intake.members), encoding="utf-8")
            warnings = _checked(intake, recipe, part, [members] if intake.members is not None else [])
            told.write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
            for written, name in moved.items():
                if written.exists():
                    os.replace(written, name)
        finally:
            for path in moved:
                with suppress(OSError):
                    path.unlink(missing_ok=True)
    except OSError as problem:
        raise cannot_write(out, problem, "choose another place with out=FILE") from None
    return warnings


def _checked(intake: Intake, recipe: Recipe, part: Path, members: Sequence[Path]) -> Sequence[str]:
    """Reads the table as train and discover will. Raises UserError that names the lines of the raw file."""
    try:
        read = read_table(part, BEDS[recipe.bed], read_members(members[0]) if members else None)
        return [_of_raw(intake, warning) for warning in read.warnings]
    except TableError as error:
        faults = [_raw_fault(intake, fault) for fault in error.faults[:MOST_FAULTS]]
        more = len(error.faults) - len(faults)
        faults += [f"… and {more} more"] if more else []
        raise UserError("\n  ".join(["The table that this recipe makes would have faults:", *faults])) from None
    except UserError as error:
        # The table is not yet where it will be.
        raise UserError(str(error).replace(str(part), "The table that this recipe makes")) from None


def _raw_fault(intake: Intake, fault: Fault) -> str:
    """A fault of the table, told by the lines of the raw file."""
    column, value = fault.column and f", {fault.column}", f"{fault.value!r} " if fault.value else ""
    problem = _of_raw(intake, fault.problem)
    return f"{_raw_line(intake, fault.line)}{column}: {value}{problem}"


def _of_raw(intake: Intake, sentence: str) -> str:
    """A sentence about the table, with the lines of the raw file."""
    return re.sub(r"line (\d+)", lambda found: _raw_line(intake, int(found[1])), sentence)


def _raw_line(intake: Intake, line: int) -> str:
    if not 2 <= line < 2 + len(intake.lines):
        return "header"
    file, raw = intake.lines[line - 2]
    return f"{file} line {raw}"


def check_out(out: Path, sources: Sequence[Path]) -> None:
    """A file that intake did not write is not overwritten, least of all the raw one."""
    if any(out.resolve() == source.resolve() for source in sources):
        raise UserError(f"out={out} is the raw file or the recipe: choose another name.")
    if out.is_dir():
        raise UserError(f"out={out} is a folder: name a file in it.")
    if out.exists() and not beside(out, PROVENANCE).exists():
        raise UserError(f"out={out} exists and is no table of intake's: choose another name, or delete it.")


def beside(out: Path, ending: str) -> Path:
    """The file beside the table whose name ends so."""
    return out.with_name(f"{out.stem}{ending}")


# A laboratory's raw file, by a recipe, to a measurement table with its provenance.


@dataclass(frozen=True)
class TakenIn:
    """path: of the table. members: of its actuators' file, None for one alone. intake: with all that is to be said."""

    path: Path
    recipe: Recipe
    members: Path | None
    intake: Intake

    @property
    def bed(self) -> str:
        """What the table's bed is called."""
        return self.recipe.bed


def taken_in(data: Path, recipe_path: Path, out: Path, design: Path | None = None) -> TakenIn:
    """Writes the table that a recipe makes of a file or a folder, and beside it its provenance and its members. design:
    the file of the actuators' designs, where it does not lie beside the data. Raises UserError."""
    text = recipe_text(recipe_path)
    recipe = recipe_of(text, str(recipe_path))
    sources = read_sources(data, recipe)
    designs = _designs(recipe, data, design)
    check_out(out, [recipe_path, data, *(data / name for name in sources), *designs])
    intake = convert(recipe, sources, next(iter(designs.values()), None))
    made = provenance(intake, recipe, data, sources, recipe_path, text, designs)
    warnings = still_open(write_intake(intake, recipe, out, made), recipe.as_read())
    members = beside(out, "_members.csv") if recipe.members else None
    said = tuple(dict.fromkeys([*intake.warnings, *warnings]))
    return TakenIn(out, recipe, members, replace(intake, warnings=said))


def _designs(recipe: Recipe, data: Path, given: Path | None) -> dict[Path, bytes]:
    """The file of designs, {} where there is none. Raises UserError."""
    if recipe.design is None:
        if given is not None:
            raise UserError(
                f"design={given} is given, but the recipe joins no designs: add design: {{file: {given.name}, "
                "by: COLUMN, columns: {…}} to it."
            )
        return {}
    if not recipe.design.file and given is None:
        return {}
    path = given or (data if is_folder(data) else data.parent) / recipe.design.file
    return {path: read_bytes(path)}


# A raw file that asks something of a fitted run, by a recipe, to a table of questions.


@dataclass(frozen=True)
class Said:
    """warnings: sentences."""

    warnings: tuple[str, ...]


@dataclass(frozen=True)
class AskedTaken:
    """path: of the table of questions. intake: with what is to be said of it."""

    path: Path
    intake: Said


def run_rows(run: Path) -> Path:
    """The file of a run's rows. Raises UserError."""
    for name in ("predictions.csv", "predictions_after.csv"):
        if (run / name).exists():
            return run / name
    raise UserError(f"{run} holds no predictions.csv: name the folder of a run of train or discover.")


def actuators_of(run: Path) -> Actuators:
    """What a run knows of its actuators, from its rows. Raises UserError."""
    return Actuators.from_table(pd.read_csv(run_rows(run)))


def asked_of(raw: Path, recipe: Path, known: Actuators, out: Path) -> AskedTaken:
    """Writes the table of questions that a recipe makes of a file. Raises UserError."""
    wanted = parse_wanted(content_of(recipe_text(recipe), str(recipe)), str(recipe))
    check_out(out, [recipe, raw])
    table = raw_table(read_bytes(raw), raw.name, wanted.reading)
    made = questions_table(wanted, table, known)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_text(out, csv_text(made))
    except OSError as problem:
        raise cannot_write(out, problem, "choose another place with --out FOLDER") from None
    return AskedTaken(out, Said(table.notes))
