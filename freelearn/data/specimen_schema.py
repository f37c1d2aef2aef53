"""What a table of specimen tests holds: the tests of a rubber sheet, their stresses, and the faults of a table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np
import pandas as pd

from freelearn.data.table.faults import Fault, Rule, faults_by_rules, no_number

# The homogeneous tests of a rubber sheet: what they are called and which stretches they impose.


@dataclass(frozen=True)
class Mode:
    """A test at stretch λ₁ along the sheet and λ₂ across it; its thickness is free of load.

    short: in tables and commands. power: λ₂ = λ₁ ** power, None where λ₂ is imposed too and each row tells it. In
    simple shear λ₁ is the larger principal stretch, and the stress is the shear stress.
    """

    name: str
    short: str
    power: float | None

    def across(self, stretch: np.ndarray) -> np.ndarray:
        """λ₂ at λ₁ (N,), both (N,); NaN where the mode leaves it to the row."""
        return np.full_like(stretch, np.nan) if self.power is None else np.power(stretch, self.power)


MODES = {
    mode.name: mode
    for mode in (
        Mode("uniaxial", "UT", -0.5),
        Mode("equibiaxial", "ET", 1.0),
        Mode("pure_shear", "PS", 0.0),
        Mode("simple_shear", "SS", 0.0),
        Mode("biaxial", "BT", None),
    )
}


SHEAR = "simple_shear"


def stretch_of_shear(amount: np.ndarray) -> np.ndarray:
    """λ₁ at an amount of shear γ = λ₁ − 1/λ₁ (Ogden 1997), (N,) → (N,); below 1 for a negative one.

    >>> stretch_of_shear(np.array([0.0, 1.5, -1.5])).tolist()
    [1.0, 2.0, 0.5]
    """
    return amount / 2 + np.sqrt(1 + (amount / 2) ** 2)


def shear_of_stretch(stretch: np.ndarray) -> np.ndarray:
    """γ = λ₁ − 1/λ₁, the other way round, (N,) → (N,)."""
    return stretch - 1 / stretch


def mode_name(text: str) -> str | None:
    """The name of the mode that a table or a command calls `text` (uniaxial, Pure shear, UT, …), None if unknown."""
    plain = text.strip().lower().replace(" ", "_").replace("-", "_")
    return next((mode.name for mode in MODES.values() if plain in (mode.name, mode.short.lower())), None)


@dataclass(frozen=True)
class Stresses:
    """Nominal stresses [MPa] with the stretches along and across their own direction, each (N,)."""

    along: np.ndarray
    across: np.ndarray
    stress_mpa: np.ndarray

    @classmethod
    def from_table(cls, rows: pd.DataFrame) -> Stresses:
        """Those of direction 1, then those of direction 2, of the rows of a specimen table; blanks are left out.

        A sheet of rubber is alike in both directions: one in direction 2 is one in direction 1 of the sheet turned.
        """
        names = ("stretch", "stretch_2", "stress_mpa"), ("stretch_2", "stretch", "stress_2_mpa")
        both = np.concatenate([rows[list(columns)].to_numpy(np.float64) for columns in names])
        along, across, stress = both[~np.isnan(both[:, 2])].T
        return cls(along, across, stress)


# What a table of specimen tests must hold, and the faults of one that does not.

COLUMNS = ("mode", "stretch", "stress_mpa", "stretch_2", "stress_2_mpa", "time_s")
# What direction 2 is stretched by and carries: a test in one direction need not tell; nor one that was slow, when.
OPTIONAL = ("stretch_2", "stress_2_mpa", "time_s")
# Stretches across that differ by more than this share from what a mode imposes are of another mode.
SAME_STRETCH = 0.02
# No specimen is stretched so far, as percent of a percent are, nor carries so much: pascals are beneath it.
MOST_STRETCH, MOST_MPA = 1e5, 1e10


def _in(mode: str, table: pd.DataFrame) -> pd.Series:
    return table["mode"] == mode


def _not_positive(column: str) -> Callable[[pd.DataFrame], pd.Series]:
    return lambda table: table[column] <= 0


def _beyond(column: str, most: float) -> Callable[[pd.DataFrame], pd.Series]:
    return lambda table: table[column].abs() > most


def _of_another_mode(table: pd.DataFrame) -> pd.Series:
    wrong = pd.Series(False, index=table.index)
    for mode in MODES.values():
        imposed = mode.across(table["stretch"].where(table["stretch"] > 0).to_numpy())
        wrong |= _in(mode.name, table) & ((table["stretch_2"] / imposed - 1).abs() > SAME_STRETCH)
    return wrong


def _unmeasured(table: pd.DataFrame) -> pd.Series:
    """Rows that hold no stress: a test in two directions may have measured the other one alone, and what a recording
    was stretched by counts for what it shows later."""
    other = table["stress_2_mpa"].notna() & ~_in("uniaxial", table) if "stress_2_mpa" in table else False
    recorded = table["time_s"].notna() if "time_s" in table else False
    return table["stress_mpa"].isna() & ~pd.Series(other, index=table.index) & ~pd.Series(recorded, index=table.index)


def _groups(table: pd.DataFrame) -> list[pd.Series]:
    """What tells the recordings of a file apart."""
    return [table["mode"].fillna(""), table["specimen"]]


def _since(table: pd.DataFrame) -> pd.Series:
    """Time since the row before of the same specimen, blank in its first."""
    return table["time_s"].groupby(_groups(table), sort=False).diff()


def _without_time(table: pd.DataFrame) -> pd.Series:
    timed = table["time_s"].notna()
    return timed.groupby(_groups(table), sort=False).transform("any") & ~timed


RULES = (
    Rule("stretch", ("stretch",), no_number("stretch"), ""),
    *(
        Rule(column, (column,), _beyond(column, most), f"is beyond {most:g}: {why}")
        for column, most, why in (
            ("stretch", MOST_STRETCH, "nothing is stretched so far, so give the length over the unloaded length"),
            ("stretch_2", MOST_STRETCH, "nothing is stretched so far, so give the length over the unloaded length"),
            ("stress_mpa", MOST_MPA, "nothing carries so much, so give megapascals"),
            ("stress_2_mpa", MOST_MPA, "nothing carries so much, so give megapascals"),
        )
    ),
    Rule("mode", ("mode",), lambda t: t["mode"].isna(), f"is no mode: write {', '.join(MODES)}"),
    *(
        Rule(
            column,
            (column,),
            _not_positive(column),
            "is not positive: give the length over the unloaded length, 1 at rest (strain + 1)",
        )
        for column in ("stretch", "stretch_2")
    ),
    Rule(
        "stretch_2",
        ("mode", "stretch_2"),
        lambda t: t["stretch_2"].isna() & _in("biaxial", t),
        "is blank: a biaxial test imposes it, so write it",
    ),
    Rule(
        "stretch_2",
        ("mode", "stretch", "stretch_2"),
        _of_another_mode,
        "is not what this mode imposes: leave it blank, or call the mode biaxial",
    ),
    Rule("stress_mpa", ("mode", "stress_mpa"), _unmeasured, ""),
    Rule(
        "time_s",
        ("mode", "specimen", "time_s"),
        _without_time,
        "is blank, and other rows of its specimen have a time: write it, or delete the line",
    ),
    Rule(
        "time_s",
        ("mode", "specimen", "time_s"),
        lambda t: _since(t) < 0,
        "is earlier than the row before: keep the rows in the order of time, and name each recording in a column "
        "specimen",
    ),
    Rule(
        "time_s",
        ("mode", "specimen", "time_s"),
        lambda t: _since(t) == 0,
        "stands twice: delete one of the two lines, or write times with more digits",
    ),
    Rule(
        "stress_2_mpa",
        ("mode", "stress_2_mpa"),
        lambda t: t["stress_2_mpa"].fillna(0).ne(0) & _in("uniaxial", t),
        "is not 0, but a uniaxial test leaves direction 2 free: leave it blank, or call the mode biaxial",
    ),
    Rule(
        "stress_2_mpa",
        ("mode", "stress_2_mpa"),
        lambda t: t["stress_2_mpa"].notna() & _in(SHEAR, t),
        "belongs to no sheared sheet, whose shear stress is stress_mpa: leave it blank",
    ),
)


def find_faults(table: pd.DataFrame, text: Mapping[str, Sequence[str]], line: int, mode: str | None) -> list[Fault]:
    """Every fault of a file's columns and rows, at most one for each cell, in the order of the file.

    table: those of COLUMNS that exist, None or NaN where a cell is no mode or no number; its index is the line in
    the file. text: every column's cells as they stand in the file. line: the header's. mode: what all rows must have.
    """
    # A blank tells something in the columns below: there a cell that holds another thing than a number is a fault.
    filled = [name for name in ("stress_mpa", *OPTIONAL) if name in text]
    rules = [*(Rule(name, (name,), _no_number_in(name, text[name]), "") for name in filled), *RULES]
    if mode is not None and "mode" in text:
        problem = f"is not {mode}, the mode that the command gives this file: correct one of the two"
        rules.append(Rule("mode", ("mode",), lambda t: t["mode"] != mode, problem))
    columns: dict[str, tuple[str | None, bool]] = {c: ("float64", c not in OPTIONAL) for c in COLUMNS}
    columns["mode"] = (None, True)
    columns["stretch_2"] = ("float64", "mode" in table and bool(_in("biaxial", table).any()))
    return faults_by_rules(table, text, line, rules, columns, _missing)


def _no_number_in(column: str, cells: Sequence[str]) -> Callable[[pd.DataFrame], pd.Series]:
    written = np.array([bool(cell.strip()) for cell in cells])
    return lambda table: table[column].isna() & written


def _missing(name: str, header: Sequence[str]) -> str:
    """What to do about a missing column: names the one that was probably meant."""
    spare = {column.lower(): column for column in header if column not in COLUMNS}
    near = get_close_matches(name, spare, n=1, cutoff=0.6)
    if near:
        return f"column is missing: rename {spare[near[0]]!r} to it"
    if name == "mode":
        return "column is missing: add it, or give the file as UT=FILE, ET=FILE, PS=FILE or BT=FILE"
    if name == "stretch_2":
        return "column is missing: add it, a biaxial test imposes it too"
    return "column is missing: add it"
