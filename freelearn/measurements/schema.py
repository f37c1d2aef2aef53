"""What a measurement table must hold, and the faults of one that does not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np
import pandas as pd

DESIGN = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
STATE = ("elongation_mm", "twist_deg", "step", "pressure_kpa")
INTEGERS = ("sample", "step", "buckled")
REQUIRED = (
    *("sample", *DESIGN, "step", "elongation_mm", "twist_deg"),
    *("pressure_kpa", "force_n", "moment_nmm", "buckled"),
)
OPTIONAL = ("time_s", "temperature_c")
# The standard atmosphere is 101.325 kPa; gauges err and weather changes little below it.
VACUUM_KPA = -101.4
# Sample and step numbers beyond this are typing errors; below it float64 holds every integer exactly.
LARGEST_NUMBER = 1_000_000_000


@dataclass(frozen=True)
class Fault:
    """One fault of a file. line: in the file, the header's is usually 1. column: "" for a whole line's fault.

    value: the offending text as it stands in the file. problem: what is wrong and what to do.
    """

    line: int
    column: str
    value: str
    problem: str


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


def _whole(numbers: pd.Series, smallest: int) -> pd.Series:
    return (numbers % 1 == 0) & numbers.between(smallest, LARGEST_NUMBER)


def _usual(column: str) -> Callable[[pd.DataFrame], pd.Series]:
    """The value that most rows of a row's sample hold: one wrong row must not accuse all the others."""

    def usual(table: pd.DataFrame) -> pd.Series:
        counts = table.groupby(["sample", column], sort=False).size()
        ranked = counts.sort_values(ascending=False, kind="stable").reset_index()
        return table["sample"].map(ranked.drop_duplicates("sample").set_index("sample")[column])

    return usual


def _differs(column: str) -> Callable[[pd.DataFrame], pd.Series]:
    def differs(table: pd.DataFrame) -> pd.Series:
        usual = _usual(column)(table)
        return usual.notna() & (table[column] != usual)

    return differs


_SAME = ("sample", *STATE, "force_n", "moment_nmm")


def _same(table: pd.DataFrame) -> list[str]:
    # Two readings at different times are two measurements, however alike.
    return [*_SAME, "time_s"] if "time_s" in table else list(_SAME)


def _repeated(table: pd.DataFrame) -> pd.Series:
    keys = table[_same(table)]
    return keys.duplicated() & keys.notna().all(axis=1)


def _first_line(table: pd.DataFrame) -> pd.Series:
    lines = table.index.to_series().groupby([table[c] for c in _same(table)])
    return lines.transform("first").astype("Int64")


RULES = (
    Rule(
        "sample",
        ("sample",),
        lambda t: ~_whole(t["sample"], 1),
        "is not a positive integer: number the actuators 1, 2, …",
    ),
    Rule(
        "gamma_deg",
        ("gamma_deg",),
        lambda t: (t["gamma_deg"] <= 0) | (t["gamma_deg"] >= 90),
        "is outside 0 … 90 (both excluded): give the fibre angle to the axis in degrees, without a sign",
    ),
    Rule(
        "length_mm",
        ("length_mm",),
        lambda t: t["length_mm"] <= 0,
        "is not positive: give the unloaded length",
    ),
    Rule(
        "elongation_mm",
        ("elongation_mm", "length_mm"),
        lambda t: (t["length_mm"] > 0) & (t["length_mm"] + t["elongation_mm"] <= 0),
        "leaves no length: give the change from length_mm, negative when shorter",
    ),
    Rule(
        "inner_radius_mm",
        ("inner_radius_mm",),
        lambda t: t["inner_radius_mm"] <= 0,
        "is not positive: give the unloaded inner radius",
    ),
    Rule(
        "outer_radius_mm",
        ("outer_radius_mm", "inner_radius_mm"),
        lambda t: t["outer_radius_mm"] <= t["inner_radius_mm"],
        "is not above inner_radius_mm: look whether the two are swapped, or one is a diameter",
    ),
    Rule(
        "step",
        ("step",),
        lambda t: ~_whole(t["step"], 0),
        "is not an integer from 0 up: count 0, 1, … in time",
    ),
    Rule(
        "pressure_kpa",
        ("pressure_kpa",),
        lambda t: t["pressure_kpa"] < VACUUM_KPA,
        "is below a vacuum: give the gauge pressure in kPa",
    ),
    Rule("buckled", ("buckled",), lambda t: ~t["buckled"].isin([0, 1]), "is neither 0 nor 1: write one of them"),
    *(
        Rule(
            column,
            ("sample", column),
            _differs(column),
            "differs from {} in the sample's other rows: correct it, or give another actuator another number",
            _usual(column),
        )
        for column in DESIGN
    ),
    Rule("", _SAME, _repeated, "duplicate of line {}: delete one of the two", _first_line),
)


def not_a_number(text: str) -> str:
    """What is wrong with a cell's text that is no finite number."""
    cell = text.strip()
    if not cell:
        return "is blank: write a number, or delete the line"
    if cell.lower().lstrip("+-") in ("nan", "na", "n/a", "null", "none", "inf", "infinity"):
        return "is not a finite number: write one, or delete the line"
    if cell.count(",") == 1 and cell.replace(",", "", 1).lstrip("+-").isdigit():
        return f"has a decimal comma: write {cell.replace(',', '.')}"
    return "is not a number: write digits with a decimal point, without a unit"


def missing_column(name: str, header: Sequence[str]) -> str:
    """What to do about a missing column: names the one that was probably meant."""
    spare = {column.lower(): column for column in header if column not in (*REQUIRED, *OPTIONAL)}
    near = get_close_matches(name, spare, n=1, cutoff=0.7)
    return f"column is missing: rename {spare[near[0]]!r} to it" if near else "column is missing: add it"


def find_faults(numbers: pd.DataFrame, text: Mapping[str, Sequence[str]], header_line: int) -> list[Fault]:
    """Every fault of a table's columns and rows, at most one for each cell, in the order of the file.

    numbers: the required and optional columns that exist, float64, NaN where `text` is no finite number; its
    index is the line in the file. text: every column's cells as they stand in the file, in the header's order.
    """
    # Here, not above: importing pandera costs a second, and simulated data need no check.
    import pandera.pandas as pa

    # Numbers first, so that a cell without one is reported as that.
    known = (*REQUIRED, *OPTIONAL)
    rules = [*(Rule(name, (name,), _no_number(name), "") for name in known), *RULES]
    rules = [rule for rule in rules if set(rule.needs) <= set(numbers)]
    schema = pa.DataFrameSchema(
        {c: pa.Column("float64", nullable=True, required=c in REQUIRED) for c in known},
        # One failure case: the rows are read off check_output, which is complete; a million cases are slow.
        checks=[pa.Check(_good(rule), name=str(i), ignore_na=False, n_failure_cases=1) for i, rule in enumerate(rules)],
    )
    faults: dict[tuple[int, str], Fault] = {}
    try:
        schema.validate(numbers, lazy=True)
    except pa.errors.SchemaErrors as report:
        for error in report.schema_errors:
            if error.reason_code is pa.errors.SchemaErrorReason.COLUMN_NOT_IN_DATAFRAME:
                name = str(error.failure_cases)
                new = [Fault(header_line, name, "", missing_column(name, list(text)))]
            elif error.check_output is None:
                raise  # A rule itself failed: ours to mend, not the user's.
            else:
                broken = np.flatnonzero(~error.check_output.to_numpy(dtype=bool))
                new = _faults_of(rules[int(error.check.name)], broken, numbers, text)
            for fault in new:
                faults.setdefault((fault.line, fault.column), fault)
    order = {name: place for place, name in enumerate(text)}
    return sorted(faults.values(), key=lambda f: (f.line, order.get(f.column, -1)))


def _no_number(column: str) -> Callable[[pd.DataFrame], pd.Series]:
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
