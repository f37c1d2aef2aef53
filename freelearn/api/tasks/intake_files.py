"""The files that intake writes: the table, its members and where they came from, all of them or none."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from freelearn.csv_text import csv_text
from freelearn.errors import UserError, cannot_write
from freelearn.files import remove_unfinished
from freelearn.measurements.beds import BEDS
from freelearn.measurements.faults import Fault, TableError
from freelearn.measurements.intake.assemble import Intake
from freelearn.measurements.intake.recipe import Recipe
from freelearn.measurements.members_table import read_members
from freelearn.measurements.table import read_table

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
