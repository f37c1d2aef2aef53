"""Faults of a table: what breaks which rule, where, what a cell without a number probably is, and what to do."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError

# Cells that are no numbers: what each probably is, and what to write instead.

# What a measurement table takes for a number, without the spaces around it.
PLAIN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# Groups of digits, apart by anything that separates thousands somewhere.
_THOUSANDS = re.compile(r"[+-]?\d{1,3}([,.'’_\s]\d{3})+([.,]\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?\d*,\d+", re.ASCII)
_WORDS = ("nan", "na", "n/a", "null", "none", "inf", "infinity", "∞")
_DASHES = str.maketrans(dict.fromkeys("\u2010\u2011\u2012\u2013\u2014\u2212\ufe63\uff0d", "-"))
# Spaces and marks that are not seen within a cell.
_UNSEEN = re.compile(r"[\s\u200b-\u200f\u2060\ufeff\u00ad]")


def not_a_number(text: str) -> str:
    """What is wrong with a cell's text that is no finite number."""
    cell = text.strip()
    if not cell:
        return "is blank: write a number, or delete the line"
    if cell.lower().lstrip("+-") in _WORDS:
        return "is not a finite number: write one, or delete the line"
    if PLAIN.fullmatch(cell):
        return "is not a number: it is larger than a computer holds, so correct it"
    return _comma(cell) or f"is not a number: {_hint(cell)}"


def _comma(cell: str) -> str:
    if not _COMMA.fullmatch(cell):
        return ""
    point = cell.replace(",", ".")
    if _THOUSANDS.fullmatch(cell) and not cell.lstrip("+-").startswith("0"):
        return f"has a decimal comma or parts its thousands: write {point} or {cell.replace(',', '')}"
    return f"has a decimal comma: write {point}"


def _hint(cell: str) -> str:
    hints = (
        (cell.startswith(("=", "@")), "it is a formula, and none is calculated: save the value"),
        (PLAIN.fullmatch(cell.replace("_", "")), "write its digits without _"),
        (_THOUSANDS.fullmatch(_spaced(cell)), "write it without what parts its thousands"),
        (PLAIN.fullmatch(cell.translate(_DASHES)), "it has a dash for a minus sign: write -"),
        (PLAIN.fullmatch(_UNSEEN.sub("", cell)), "it holds spaces or marks that are not seen: type it anew"),
        (PLAIN.fullmatch(unicodedata.normalize("NFKC", cell)), "write its digits as 0 … 9"),
        (cell.startswith("#"), "it is what a spreadsheet shows instead of one: blank the cell, or delete the line"),
        (PLAIN.fullmatch(cell.rstrip("% ")), "it has a percent sign: write the quantity in the column's unit"),
    )
    return next((hint for found, hint in hints if found), "write digits with a decimal point, without a unit")


def _spaced(cell: str) -> str:
    """The cell with every kind of space as a plain one."""
    return "".join(" " if c.isspace() else c for c in cell)


# Faults of a table: what breaks which rule, where, and what to do about it.

PRINTED_FAULTS = 20
PRINTED_CHARACTERS = 40


@dataclass(frozen=True)
class Fault:
    """One fault of a file. line: in the file, the header's is usually 1. column: "" for a whole line's fault.

    value: the offending text as it stands in the file. problem: what is wrong and what to do.
    """

    line: int
    column: str
    value: str
    problem: str


class TableError(UserError):
    """A table with faults. faults: all of them, in the order of the file; the message prints the first 20. foreign:
    whether so many columns are missing that it is hardly meant for one; its path is then `UserError.foreign`."""

    def __init__(self, path: str | Path, faults: Sequence[Fault], foreign: bool = False) -> None:
        self.faults, self.foreign = list(faults), str(path) if foreign else ""
        count = "1 fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
        printed = [_printed(fault) for fault in self.faults[:PRINTED_FAULTS]]
        if len(self.faults) > PRINTED_FAULTS:
            printed.append(f"… and {len(self.faults) - PRINTED_FAULTS} more")
        super().__init__("\n  ".join([f"{path} has {count}:", *printed]))


@dataclass(frozen=True)
class Rule:
    """A condition on rows.

    column: where a fault is reported, "" for the whole line. needs: columns without which it cannot be judged.
    bad: the rows that break it. problem: "" where the cell's text tells it. detail: for each row, what fills the
    braces of the problem.
    """

    column: str
    needs: tuple[str, ...]
    bad: Callable[[pd.DataFrame], pd.Series]
    problem: str
    detail: Callable[[pd.DataFrame], pd.Series] | None = None


def faults_by_rules(
    table: pd.DataFrame,
    text: Mapping[str, Sequence[str]],
    header_line: int,
    rules: Sequence[Rule],
    columns: Mapping[str, tuple[str | None, bool]],
    missing: Callable[[str, Sequence[str]], str],
) -> list[Fault]:
    """Every fault of a table's columns and rows, at most one for each cell, in the order of the file.

    table: its index is the line in the file. text: every column's cells as they stand in the file, in the header's
    order. rules: the first that a cell breaks is the one reported. columns: name → its type (None: any), whether the
    table must have it. missing: what to do about a missing column, from its name and the header.
    """
    # Here, not above: importing pandera costs a second, and simulated data need no check.
    import pandera.pandas as pa

    rules = [rule for rule in rules if set(rule.needs) <= set(table)]
    schema = pa.DataFrameSchema(
        {name: pa.Column(kind, nullable=True, required=must) for name, (kind, must) in columns.items()},
        # One failure case: the rows are read off check_output, which is complete; a million cases are slow.
        checks=[pa.Check(_good(rule), name=str(i), ignore_na=False, n_failure_cases=1) for i, rule in enumerate(rules)],
    )
    faults: dict[tuple[int, str], Fault] = {}
    try:
        schema.validate(table, lazy=True)
    except pa.errors.SchemaErrors as report:
        for error in report.schema_errors:
            if error.reason_code is pa.errors.SchemaErrorReason.COLUMN_NOT_IN_DATAFRAME:
                name = str(error.failure_cases)
                new = [Fault(header_line, name, "", missing(name, list(text)))]
            elif error.check_output is None:
                raise  # A rule itself failed: ours to mend, not the user's.
            else:
                broken = np.flatnonzero(~error.check_output.to_numpy(dtype=bool))
                new = _faults_of(rules[int(error.check.name)], broken, table, text)
            for fault in new:
                faults.setdefault((fault.line, fault.column), fault)
    order = {name: place for place, name in enumerate(text)}
    return sorted(faults.values(), key=lambda f: (f.line, order.get(f.column, -1)))


def no_number(column: str) -> Callable[[pd.DataFrame], pd.Series]:
    """The rows of a column that hold no number."""
    return lambda table: table[column].isna()


def _good(rule: Rule) -> Callable[[pd.DataFrame], pd.Series]:
    return lambda table: ~rule.bad(table)


def _faults_of(rule: Rule, broken: np.ndarray, numbers: pd.DataFrame, text: Mapping[str, Sequence[str]]) -> list[Fault]:
    """Faults of the rows numbered `broken`, which break the rule."""
    lines = numbers.index.to_numpy()[broken].tolist()
    cells = [text[rule.column][row] if rule.column else "" for row in broken]
    if not rule.problem:
        problems = [not_a_number(cell) for cell in cells]
    elif rule.detail is None:
        problems = [rule.problem] * len(lines)
    else:
        problems = [rule.problem.format(detail) for detail in rule.detail(numbers).iloc[broken]]
    return [Fault(*of) for of in zip(lines, [rule.column] * len(lines), cells, problems, strict=True)]


def _printed(fault: Fault) -> str:
    # repr shows control characters instead of sending them to the terminal.
    column = f", {repr(fault.column)[1:-1]}" if fault.column else ""
    cut = "…" if len(fault.value) > PRINTED_CHARACTERS else ""
    value = f" {fault.value[:PRINTED_CHARACTERS] + cut!r}" if fault.value else ""
    return f"line {fault.line}{column}:{value} {fault.problem}"
