"""A raw file that asks something of a fitted run, by a recipe, to a table of questions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from freelearn.api.tasks.intake_files import check_out
from freelearn.csv_text import csv_text
from freelearn.errors import UserError, cannot_write
from freelearn.files import write_text
from freelearn.measurements.intake.raw_file import raw_table
from freelearn.measurements.intake.recipe_file import content_of, recipe_text
from freelearn.measurements.intake.wanted import Actuators, parse_wanted, questions_table
from freelearn.measurements.text_file import read_bytes


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
    return Actuators.of(pd.read_csv(run_rows(run)))


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
