"""Several actuators in parallel on one end block: their designs, and the columns that a table then has."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pandas as pd

# Columns of the file of members, and of a table whose actuators stand alone.
DESIGN = ("gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
SECOND = "gamma2_deg"


def pressure_column(member: int) -> str:
    """The column with a member's pressure.

    >>> pressure_column(2)
    'pressure_2_kpa'
    """
    return f"pressure_{member}_kpa"


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
