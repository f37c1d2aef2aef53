"""What a measurement table must hold, and the faults of one that does not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches

import pandas as pd

from freelearn.measurements.faults import Fault, Rule, faults_by_rules, no_number
from freelearn.measurements.usable import LEFT_OUT

DESIGN = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
STATE = ("elongation_mm", "twist_deg", "step", "pressure_kpa")
INTEGERS = ("sample", "step", "buckled", LEFT_OUT)
REQUIRED = (
    *("sample", *DESIGN, "step", "elongation_mm", "twist_deg"),
    *("pressure_kpa", "force_n", "moment_nmm", "buckled"),
)
OPTIONAL = ("time_s", "temperature_c", LEFT_OUT)
# The standard atmosphere is 101.325 kPa; gauges err and weather changes little below it.
VACUUM_KPA = -101.4
# Sample and step numbers beyond this are typing errors; below it float64 holds every integer exactly.
LARGEST_NUMBER = 1_000_000_000


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


def _no_mark(column: str) -> Callable[[pd.DataFrame], pd.Series]:
    return lambda table: ~table[column].isin([0, 1])


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
        "is outside 0 … 90 (both excluded): give the fiber angle to the axis in degrees, without a sign",
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
    *(
        Rule(column, (column,), _no_mark(column), "is neither 0 nor 1: write one of them")
        for column in ("buckled", LEFT_OUT)
    ),
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


def missing_column(name: str, header: Sequence[str]) -> str:
    """What to do about a missing column: names the one that was probably meant."""
    spare = {column.lower(): column for column in header if column not in (*REQUIRED, *OPTIONAL)}
    near = get_close_matches(name, spare, n=1, cutoff=0.7)
    return f"column is missing: rename {spare[near[0]]!r} to it" if near else "column is missing: add it"


def find_faults(numbers: pd.DataFrame, text: Mapping[str, Sequence[str]], header_line: int) -> list[Fault]:
    """Every fault of a measurement table.

    numbers: the required and optional columns that exist, float64, NaN where `text` is no finite number; its
    index is the line in the file. text: every column's cells as they stand in the file, in the header's order.
    """
    known = (*REQUIRED, *OPTIONAL)
    # Numbers first, so that a cell without one is reported as that.
    rules = [*(Rule(name, (name,), no_number(name), "") for name in known), *RULES]
    columns: dict[str, tuple[str | None, bool]] = {name: ("float64", name in REQUIRED) for name in known}
    return faults_by_rules(numbers, text, header_line, rules, columns, missing_column)
