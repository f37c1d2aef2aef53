"""Reading a table of questions: a measurement table whose blanks are to be answered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.beds import DIAMETER, ELONGATION, FORCE, MOMENT, TWIST
from freelearn.data.columns import DESIGN, INTEGERS, OPTIONAL, SECOND, Columns
from freelearn.data.table.faults import Fault, Rule, TableError, faults_by_rules
from freelearn.data.table.limits import design_rules, limit_rules
from freelearn.data.table.records import columns_of, nearly_named, numbers_of, read_records, refuse_separators
from freelearn.data.table.schema import RULES, number_rules

# Two columns of places and two of loads, whatever the bed; the pressures join them.
ASKED = tuple(q.column for q in (ELONGATION, TWIST, FORCE, MOMENT, DIAMETER))


@dataclass(frozen=True)
class Questions:
    """table: the file's columns and rows in their order: known ones as float64, NaN where a cell is blank, others as
    the text in the file. lines: the line in the file at which each row begins, (N,) int64. warnings: sentences."""

    table: pd.DataFrame
    lines: np.ndarray
    warnings: list[str]


def read_questions(path: str | Path, columns: Columns) -> Questions:
    """Reads a table of which any quantity may be blank, or its column absent. Raises UserError, and TableError with all
    faults.

    columns: of the table that the model was fitted on."""
    records = read_records(path)
    header = [name.strip() for name in records.header]
    known_names = (*columns.pressures, *ASKED, "sample", *DESIGN, SECOND, *INTEGERS, *OPTIONAL)
    refuse_separators(path, header, known_names)
    if not set(header) & {*columns.pressures, *ASKED}:
        near = [m for name in header for m in get_close_matches(name, (*columns.pressures, *ASKED), n=1)]
        hint = f" Is {near[0]} meant by one of them?" if near else ""
        raise UserError(
            f"{path} asks nothing: it has none of the columns {', '.join((*columns.pressures, *ASKED))}.{hint}"
        )
    if not records.rows:
        raise UserError(f"{path} holds no rows: add a row for each question below its header.")
    text, lines, faults = columns_of(records, header)
    known = [name for name in dict.fromkeys(known_names) if name in text]
    numbers = pd.DataFrame({name: numbers_of(text[name]) for name in known}, index=pd.Index(lines, dtype=np.int64))
    faults += faults_of_given(numbers, text, records.header_line, known)
    if faults:
        raise TableError(path, sorted(faults, key=lambda fault: fault.line))
    numbers = numbers.reset_index(drop=True)
    table = pd.DataFrame({name: numbers[name] if name in numbers else list(text[name]) for name in text})
    return Questions(table, np.array(lines, dtype=np.int64), nearly_named(header, (*columns.pressures, *ASKED), known))


def faults_of_given(
    numbers: pd.DataFrame, text: Mapping[str, Sequence[str]], header_line: int, known: Sequence[str]
) -> list[Fault]:
    """Cells that are no numbers, designs that are none, and values that no bed can have. Any cell may be blank.

    numbers: of the known columns, NaN where there is none; its index is the line in the file. text: every column's
    cells as they stand there.
    """
    kept = [_of_given(rule) for rule in (*design_rules(), *RULES, *limit_rules(known)) if rule.column]
    rules = [*number_rules(known, text, known), *kept]
    types: dict[str, tuple[str | None, bool]] = dict.fromkeys(known, ("float64", False))
    return faults_by_rules(numbers, text, header_line, rules, types, lambda name, head: "")


def _of_given(rule: Rule) -> Rule:
    """The same rule for cells that are not blank."""
    return replace(rule, bad=lambda table: rule.bad(table) & table[rule.column].notna())
