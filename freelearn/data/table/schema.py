"""What a measurement table must hold, and the faults of one that does not."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from difflib import get_close_matches

import numpy as np
import pandas as pd

from freelearn.data.columns import DESIGN, MARKS, SECOND, Columns
from freelearn.data.logs import RUN, TIME
from freelearn.data.table.faults import Fault, Rule, faults_by_rules, no_number
from freelearn.data.table.limits import design_rules, limit_rules

# The standard atmosphere is 101.325 kPa; gauges err and weather changes little below it.
VACUUM_KPA = -101.4
ABSOLUTE_ZERO_C = -273.15
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


def _alike(keys: pd.DataFrame) -> np.ndarray:
    """Rows with the digest of another one, (N,) bool: all that repeat each other, and hardly any more.

    Rows themselves are compared by tables of every column's values, which take ten times the memory of the columns."""
    digest = np.zeros(len(keys), dtype=np.uint64)
    for _, column in keys.items():
        # Not -0.0, which equals 0.0 but in its bits.
        digest = digest * np.uint64(1_000_003) ^ pd.util.hash_array(column.to_numpy(np.float64) + 0.0)
    ordered = np.sort(digest)
    several = np.unique(ordered[1:][ordered[1:] == ordered[:-1]])
    del ordered
    place = np.searchsorted(several, digest)
    alike: np.ndarray = np.append(several, 0)[place] == digest if len(several) else np.zeros(len(keys), dtype=bool)
    return alike


class _Repeats:
    """Rows that say the same as an earlier one."""

    def __init__(self, columns: Columns) -> None:
        self.columns = columns

    @property
    def rule(self) -> Rule:
        needs = ("sample", *self.columns.state)
        return Rule("", needs, self._repeated, "duplicate of line {}: delete one of the two", self._first_line)

    def _keys(self, table: pd.DataFrame) -> pd.DataFrame:
        # Two readings at different times are two measurements, however alike.
        names = ("sample", *self.columns.state, *self.columns.measured, "time_s")
        return table[[name for name in names if name in table]]

    def _repeated(self, table: pd.DataFrame) -> pd.Series:
        keys = self._keys(table)
        repeated = pd.Series(np.zeros(len(table), dtype=bool), index=table.index)
        if keys.shape[1] <= len(self.columns.state) + 1:
            return repeated
        like = np.flatnonzero(_alike(keys))
        again = keys.iloc[like]
        repeated.iloc[like] = (again.duplicated() & again.notna().all(axis=1)).to_numpy()
        return repeated

    def _first_line(self, table: pd.DataFrame) -> pd.Series:
        keys = self._keys(table)
        lines = table.index.to_series().groupby([keys[name] for name in keys])
        return lines.transform("first").astype("Int64")


RULES = (
    Rule(
        "sample",
        ("sample",),
        lambda t: ~_whole(t["sample"], 1),
        "is not a positive integer: number the actuators 1, 2, …",
    ),
    Rule(
        "elongation_mm",
        ("elongation_mm", "length_mm"),
        lambda t: (t["length_mm"] > 0) & (t["length_mm"] + t["elongation_mm"] <= 0),
        "leaves no length: give the change from length_mm, negative when shorter",
    ),
    Rule(
        "step",
        ("step",),
        lambda t: ~_whole(t["step"], 0),
        "is not an integer from 0 up: count 0, 1, … in time",
    ),
    Rule(
        "outer_diameter_mm",
        ("outer_diameter_mm",),
        lambda t: t["outer_diameter_mm"] <= 0,
        "is not positive: give the outer diameter under pressure",
    ),
    Rule(
        "temperature_c",
        ("temperature_c",),
        lambda t: t["temperature_c"] < ABSOLUTE_ZERO_C,
        "is below absolute zero: give degrees Celsius",
    ),
    *(Rule(column, (column,), _no_mark(column), "is neither 0 nor 1: write one of them") for column in MARKS),
    *(
        Rule(
            column,
            ("sample", column),
            _differs(column),
            "differs from {} in the sample's other rows: correct it, or give another actuator another number",
            _usual(column),
        )
        for column in (*DESIGN, SECOND)
    ),
)


def _below_vacuum(column: str) -> Rule:
    return Rule(
        column, (column,), lambda t: t[column] < VACUUM_KPA, "is below a vacuum: give the gauge pressure in kPa"
    )


def missing_column(name: str, header: Sequence[str], known: Sequence[str]) -> str:
    """What to do about a missing column: names the one that was probably meant."""
    near = _near(name, header, known)
    return f"column is missing: rename {near!r} to it" if near else "column is missing: add it"


def _near(name: str, header: Sequence[str], known: Sequence[str]) -> str:
    """The column that was probably meant; "" where none is like it."""
    spare = {column.lower(): column for column in header if column not in known}
    found = get_close_matches(name, spare, n=1, cutoff=0.7)
    return spare[found[0]] if found else ""


def find_faults(
    numbers: pd.DataFrame, text: Mapping[str, Sequence[str]], header_line: int, columns: Columns
) -> list[Fault]:
    """Every fault of a measurement table.

    numbers: the known columns that exist, float64, NaN where `text` is no finite number; its index is the line in the
    file. text: every column's cells as they stand in the file, in the header's order.
    """
    known = columns.known
    # Numbers first, so that a cell without one is reported as that.
    rules = [*number_rules(known, text, _may_be_blank(columns)), *_rules(columns, text)]
    types: dict[str, tuple[str | None, bool]] = {name: ("float64", name in columns.required) for name in known}
    faults = faults_by_rules(
        numbers, text, header_line, rules, types, lambda n, header: missing_column(n, header, known)
    )
    return [*faults, *_nothing_measured(text, header_line, columns)]


def faultless(numbers: pd.DataFrame, header: Sequence[str], columns: Columns) -> bool:
    """Whether a table of which nothing but blank cells is NaN has no fault: `find_faults` then finds none."""
    if not set(columns.required) <= set(header) or _nothing_measured(dict.fromkeys(header, ()), 1, columns):
        return False
    filled = [name for name in columns.known if name not in _may_be_blank(columns)]
    rules = [*number_rules(filled, {}, ()), *_rules(columns, header)]
    # Not as one table, which would take a mark for each cell.
    return not any(rule.bad(numbers).any() for rule in rules if set(rule.needs) <= set(numbers))


def _may_be_blank(columns: Columns) -> set[str]:
    return {*columns.measured, *columns.blank}


def _rules(columns: Columns, header: Collection[str]) -> list[Rule]:
    """What numbers may break."""
    rules = [*design_rules(), *RULES, *map(_below_vacuum, columns.pressures)]
    rules += limit_rules(columns.known, columns.measured)
    # Recordings may begin alike; that their times do not repeat is looked at by itself.
    return rules if {TIME, RUN} <= set(header) else [*rules, _Repeats(columns).rule]


def number_rules(known: Sequence[str], text: Mapping[str, Sequence[str]], may_be_blank: Collection[str]) -> list[Rule]:
    """A rule for each column: its cells are numbers, or blank where they may be."""
    return [Rule(name, (name,), _no_number_in(name, text if name in may_be_blank else {}), "") for name in known]


def _no_number_in(name: str, text: Mapping[str, Sequence[str]]) -> Callable[[pd.DataFrame], pd.Series]:
    """Rows without a number in a column; text: of it, where a blank is none."""
    if name not in text:
        return no_number(name)
    written = [bool(cell.strip()) for cell in text[name]]
    return lambda table: table[name].isna() & pd.Series(written, index=table.index)


def _nothing_measured(text: Mapping[str, Sequence[str]], header_line: int, columns: Columns) -> list[Fault]:
    """Faults of measured columns that are absent: all of them, or one that another column's name nearly is."""
    absent = [name for name in columns.measured if name not in text]
    known = columns.known
    if len(absent) < len(columns.measured):
        absent = [name for name in absent if _near(name, list(text), known)]
    return [Fault(header_line, name, "", missing_column(name, list(text), known)) for name in absent]
