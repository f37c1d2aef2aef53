"""What a file asks of a fitted actuator, such as the pressures of a trajectory: its columns as those of a table of
questions, and what it does not say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.columns import members_in, pressure_columns
from freelearn.data.intake.evaluate import Evaluation
from freelearn.data.intake.guesses.column_questions import meaning_of, signs_of_the_loads, units_open, which_of
from freelearn.data.intake.guesses.guessed import Answers, Guess
from freelearn.data.intake.guesses.meanings import MEANINGS
from freelearn.data.intake.guesses.recipe_entries import column_entry
from freelearn.data.intake.guesses.recipe_text import Path, recipe_lines
from freelearn.data.intake.guesses.typed_answers import Question
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.recipes.recipe import DESIGN, Column, Reading
from freelearn.data.intake.recipes.recipe_columns import columns_of
from freelearn.data.intake.recipes.recipe_parts import reading_of
from freelearn.data.intake.recipes.recipe_section import Section, is_number

PLACES, LOADS = ("elongation_mm", "twist_deg"), ("force_n", "moment_nmm")
ASKED = "?"
FURTHER = ("time_s",)


@dataclass(frozen=True)
class Actuators:
    """What a fitted run knows of its actuators. designs: number → constants in the table's units. members: actuators on
    one end block, 0 for one alone. held: what was the same in all of its rows."""

    designs: Mapping[int, Mapping[str, float]]
    members: int
    held: Mapping[str, float]

    @classmethod
    def from_table(cls, table: pd.DataFrame) -> Actuators:
        """Of a run's rows."""
        members = len(members_in(list(table.columns)))
        names = [name for name in DESIGN if name in table]
        designs = {int(n): rows[names].iloc[0].dropna().to_dict() for n, rows in table.groupby("sample")}
        held = {n: float(table[n].iloc[0]) for n in PLACES if n in table and table[n].nunique(dropna=False) == 1}
        return cls(designs, members, held)

    @property
    def pressures(self) -> tuple[str, ...]:
        """Columns of the pressures."""
        return pressure_columns(range(1, self.members + 1))

    @property
    def asked(self) -> tuple[str, ...]:
        """All that may be asked, or given."""
        return (*PLACES, *self.pressures, *LOADS)


def given_by(found: Guess, known: Actuators) -> dict[str, str]:
    """Column of a table of questions → the file's that becomes it."""
    given = {c.column: c.name for c in found.columns if c.chosen and c.column in (*known.asked, *FURTHER)}
    if known.members and found.pressures:
        given |= dict(zip(known.pressures, found.pressures, strict=False))
    return given


def wanted_questions(found: Guess, known: Actuators, answers: Answers) -> Iterator[Question]:
    """What the file does not say: columns that no heading explains, units, signs, and what holds in all rows."""
    given = given_by(found, known)
    yield from which_of(found, answers)
    for column in found.columns:
        if f"what.{column.name}" in answers or (column.numeric and column.quantity is None):
            yield meaning_of(column)
    if len(known.designs) > 1 and found.of("sample") is None:
        options = tuple((str(number), f"sample {number}") for number in known.designs)
        yield Question("sample", "Of which actuator of the run?", "choice", "", options, None, "actuator")
    for name in known.asked:
        if name in given:
            continue
        words = MEANINGS["pressure_kpa" if name.startswith("pressure") else name].words
        which = name.split("_")[1] if name.startswith("pressure_") and known.members else ""
        whose = f"{words} of actuator {which}" if which else words
        text = f"No column is the {whose}. Its value in all rows, or ? where that is what is asked"
        likely: str | float = known.held.get(name, ASKED)
        yield Question(f"given.{name}", text, "given", name, proposed=likely, short=f"{words} {which}".strip())
    yield from units_open(found, answers)
    yield from signs_of_the_loads(found)


def wanted_draft(found: Guess, known: Actuators, answers: Answers) -> str:
    """The recipe's text."""
    given = given_by(found, known)
    content: dict[str, Any] = {"asks": [name for name in known.asked if name not in given]}
    if found.sheet:
        content["read"] = {"sheet": found.sheet}
    sample = found.of("sample")
    content["sample"] = {"from": sample.name} if sample else int(answers.get("sample", next(iter(known.designs))))
    constants = {n: answers[f"given.{n}"] for n in content["asks"] if answers.get(f"given.{n}", ASKED) != ASKED}
    content["asks"] = [name for name in content["asks"] if name not in constants]
    content["constants"] = constants
    by_name = {c.name: c for c in found.columns}
    content["columns"] = {name: column_entry(by_name[source], name, answers)[0] for name, source in given.items()}
    remarks: dict[Path, str] = {("asks",): "left blank: what the fitted run answers"}
    return "\n".join([f"# What {found.name} asks of a fitted run.", *recipe_lines(content, remarks)]) + "\n"


@dataclass(frozen=True)
class Wanted:
    """A recipe of questions. sample: a number, or the column that says it."""

    columns: Mapping[str, Column]
    constants: Mapping[str, float]
    sample: int | str
    reading: Reading


def parse_wanted(content: Mapping[str, Any], name: str) -> Wanted:
    """The recipe in plain values. Raises UserError with every mistake."""
    mistakes: list[str] = []
    root = Section(content, "", mistakes)
    root.only(("about", "asks", "read", "sample", "constants", "columns"))
    section = root.section("constants")
    constants = {key: value for key, _ in section.items() if (value := section.number(key)) is not None}
    pressures = {k: v for k, v in root.section("columns").items() if k.startswith("pressure_") and k != "pressure_kpa"}
    rest = {k: v for k, v in root.section("columns").items() if k not in pressures}
    columns = columns_of(Section(rest, "columns", mistakes))
    for key, value in pressures.items():
        columns |= {key: columns_of(Section({"pressure_kpa": value}, "columns", mistakes))["pressure_kpa"]}
    number = root.content.get("sample", 1)
    sample: int | str = int(number) if is_number(number) else root.section("sample").text("from")
    if mistakes:
        raise UserError("\n  ".join([f"{name} has mistakes:", *dict.fromkeys(mistakes)]))
    return Wanted(columns, constants, sample, reading_of(root.section("read")))


def questions_table(wanted: Wanted, raw: RawTable, known: Actuators) -> pd.DataFrame:
    """The table of questions, (N,) rows; what is asked has no column. Raises UserError."""
    numbers = np.full(len(raw), wanted.sample) if isinstance(wanted.sample, int) else raw.numbers(wanted.sample)
    if unknown := sorted({int(n) for n in numbers} - set(known.designs)):
        raise UserError(f"The run knows no sample {unknown[0]}: it has {', '.join(map(str, known.designs))}.")
    names = {name for design in known.designs.values() for name in design}
    constants = {name: np.array([known.designs[int(n)].get(name, np.nan) for n in numbers]) for name in names}
    rows = Evaluation(raw, wanted.columns, constants, numbers.astype(np.int64))
    made = {
        name: rows.quantity(name)
        for name in wanted.columns
        if not name.startswith("pressure_") or name == "pressure_kpa"
    }
    for name, column in wanted.columns.items():
        if name not in made:
            made[name] = rows.make(name, column)
    order = [n for n in (*FURTHER, *PLACES, *known.pressures, *LOADS) if n in made or n in wanted.constants]
    table = pd.DataFrame({"sample": numbers.astype(np.int64)})
    return table.assign(**{name: made.get(name, wanted.constants.get(name)) for name in order})
