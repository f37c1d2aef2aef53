"""The columns of a measurement table: by bed and by the number of actuators, which rows count, and what they show."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from freelearn.data.beds import FORCE, KINEMATIC, MOMENT, Bed, bed_of

# Several actuators in parallel on one end block: their designs, and the columns that a table then has.

# Columns of the file of members, and of a table whose actuators stand alone.
DESIGN = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
SECOND = "gamma2_deg"


def pressure_column(member: int) -> str:
    """The column with a member's pressure.

    >>> pressure_column(2)
    'pressure_2_kpa'
    """
    return f"pressure_{member}_kpa"


def pressure_columns(members: Iterable[int]) -> tuple[str, ...]:
    """Those of an end block's members, or of an actuator alone.

    >>> pressure_columns([])
    ('pressure_kpa',)
    """
    return tuple(map(pressure_column, members)) or ("pressure_kpa",)


def design_column(name: str, member: int) -> str:
    """The column in which the program keeps a member's design beside each row.

    >>> design_column("gamma_deg", 2)
    'gamma_2_deg'
    """
    stem, unit = name.rsplit("_", 1)
    return f"{stem}_{member}_{unit}"


def members_in(columns: Sequence[str]) -> list[int]:
    """The numbers of the members whose pressures a table has, in order.

    >>> members_in(["sample", "pressure_2_kpa", "pressure_1_kpa"])
    [1, 2]
    """
    return sorted(int(m.group(1)) for c in columns if (m := re.fullmatch(r"pressure_([1-9]\d{0,2})_kpa", str(c))))


def with_members(table: pd.DataFrame, members: pd.DataFrame) -> pd.DataFrame:
    """A table of an end block with its members' designs beside each row, so that it tells all by itself.

    members: member, the design and perhaps gamma2_deg, a row for each. The columns of a single actuator are filled too,
    for what needs one number a row: the first member's design and the mean pressure. What a table that was written so
    says of them itself is put in its place.
    """
    more: dict[str, float | pd.Series] = {}
    for _, row in members.iterrows():
        number = int(row["member"])
        for name in (*DESIGN, SECOND):
            if name in members:
                more[design_column(name, number)] = float(row[name])
    first = members.iloc[0]
    more |= {name: float(first[name]) for name in (*DESIGN, SECOND) if name in members}
    more["pressure_kpa"] = table[[pressure_column(int(m)) for m in members["member"]]].mean(axis=1)
    return table.assign(**more)


# Which rows of a measurement table are fitted and scored.

# A column that a table may have: 1 where the user wants a row left out.
LEFT_OUT = "left_out"
# Another: 1 where the tube hangs loose.
SLACK = "slack"
# Another: 1 where rising pressure reached a state's first row.
RISEN = "risen"


def usable_rows(table: pd.DataFrame) -> np.ndarray:
    """Rows that may be fitted and scored, (N,) bool: neither buckled nor left out by the user.

    The others still belong to their kinematic state and to what the rubber remembers.

    >>> usable_rows(pd.DataFrame({"buckled": [0, 1, 0], "left_out": [0, 0, 1]})).tolist()
    [True, False, False]
    """
    usable: np.ndarray = (table["buckled"] == 0).to_numpy()
    if LEFT_OUT in table:
        usable = usable & (table[LEFT_OUT] == 0).to_numpy()
    return usable


def used_rows(table: pd.DataFrame) -> pd.DataFrame:
    """The table's usable rows; the table itself where all are, which on large ones saves a copy."""
    usable = usable_rows(table)
    return table if usable.all() else table[usable]


def left_out_rows(table: pd.DataFrame) -> np.ndarray:
    """Rows that only the user's mark keeps from being fitted and scored, (N,) bool: buckled ones are not counted twice.

    >>> left_out_rows(pd.DataFrame({"buckled": [0, 1, 0], "left_out": [0, 1, 1]})).tolist()
    [False, False, True]
    """
    left_out: np.ndarray = (table["buckled"] == 0).to_numpy() & ~usable_rows(table)
    return left_out


def shown_readings(table: pd.DataFrame, predicted: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values (N, 2) SI, zero where nothing was measured; whether each is there, (N, 2) bool; and in which rows the tube
    hangs loose, (N,) bool.

    table: a measurement table; predicted: what a model says there, of the columns of predictions.csv."""
    bed = bed_of(table)
    value, present = _columns(table, bed, predicted)
    slack = np.zeros(len(table), dtype=bool)
    if SLACK in table and FORCE in bed.measured:
        slack = table[SLACK].to_numpy(np.float64) == 1
    # A tube that hangs loose carries no moment that could tell anything.
    present = present & ~(slack[:, None] & np.array([q is MOMENT for q in bed.readings]))
    return np.where(present, value, 0.0), present, slack


def _columns(table: pd.DataFrame, bed: Bed, predicted: bool) -> tuple[np.ndarray, np.ndarray]:
    """Values (N, 2) SI of the bed's channels, and whether each is there."""
    blank = np.full(len(table), np.nan)
    columns = []
    for quantity in bed.readings:
        name = quantity.predicted if predicted else quantity.column
        there = quantity in bed.measured and name in table
        columns.append(table[name].to_numpy(np.float64) * quantity.factor if there else blank)
    value = np.stack(columns, axis=1)
    return value, np.isfinite(value)


# The columns of a measurement table, by bed and by the number of actuators on one end block.

# Marks of 0 or 1; a blank one marks nothing, but for that of buckling.
MARKS = ("buckled", LEFT_OUT, SLACK, RISEN)
INTEGERS = ("sample", "step", *MARKS)
OPTIONAL = ("time_s", "temperature_c", LEFT_OUT, SLACK, RISEN)


@dataclass(frozen=True)
class Columns:
    """What the columns of a table are, of a bed and of one actuator (members 0) or several on one end block.

    required: must be there, and hold a number in every row. measured: may be blank or absent, but not all of them.
    blank: optional, and may be blank. optional: may be absent."""

    bed: Bed = KINEMATIC
    members: int = 0

    @classmethod
    def from_table(cls, table: pd.DataFrame) -> Columns:
        """Of a table in the program."""
        return cls(bed_of(table), len(members_in(table.columns)))

    @property
    def pressures(self) -> tuple[str, ...]:
        """The imposed pressures."""
        return pressure_columns(range(1, self.members + 1))

    @property
    def imposed(self) -> tuple[str, ...]:
        """What the bed imposes: its two quantities, and the pressures."""
        return (*(quantity.column for quantity in self.bed.state), *self.pressures)

    @property
    def state(self) -> tuple[str, ...]:
        """What tells one row of a sample from another."""
        return (*(quantity.column for quantity in self.bed.state), "step", *self.pressures)

    @property
    def required(self) -> tuple[str, ...]:
        """Columns that must be there, in the order of the contract."""
        design = () if self.members else DESIGN
        first, second = (quantity.column for quantity in self.bed.state)
        return ("sample", *design, "step", first, second, *self.pressures, "buckled")

    @property
    def measured(self) -> tuple[str, ...]:
        """Columns of what the bed measures."""
        return tuple(quantity.column for quantity in self.bed.measured)

    @property
    def blank(self) -> tuple[str, ...]:
        """Optional columns of which cells may be blank."""
        return () if self.members else (SECOND,)

    @property
    def known(self) -> tuple[str, ...]:
        """Every column that means something."""
        return (*self.required, *self.measured, *self.blank, *OPTIONAL)

    @property
    def listed(self) -> tuple[str, ...]:
        """The columns of a whole table, in the order of the contract."""
        return (*self.required[:-1], *self.measured, "buckled")
