"""Reading the members of an end block: a CSV file with a row for each actuator's design."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.columns import DESIGN, SECOND
from freelearn.data.table.faults import Fault, Rule, TableError, faults_by_rules
from freelearn.data.table.limits import design_rules, limit_rules
from freelearn.data.table.records import columns_of, numbers_of, read_records
from freelearn.data.table.schema import missing_column, number_rules

# More would be no end block but a typing error.
MOST_MEMBERS = 100


def read_members(path: str | Path) -> pd.DataFrame:
    """The members of an end block: member (1, 2, …), the design, and perhaps gamma2_deg, a row for each.

    Raises TableError with all faults, and UserError where the file as a whole is no such table.
    """
    records = read_records(path)
    header = [name.strip() for name in records.header]
    text, _, faults = columns_of(records, header)
    if faults:
        raise TableError(path, faults)
    if not records.rows:
        raise UserError(f"{path} holds no members: add a row for each actuator below its header.")
    required = ("member", *DESIGN)
    known = (*required, SECOND)
    numbers = pd.DataFrame(
        {name: numbers_of(text[name]) for name in known if name in text}, index=pd.Index(records.lines, dtype=np.int64)
    )
    rules = [*number_rules(known, text, {SECOND}), *design_rules(), *limit_rules(known), _in_order(len(numbers))]
    types: dict[str, tuple[str | None, bool]] = {name: ("float64", name in required) for name in known}
    found: list[Fault] = faults_by_rules(
        numbers, text, records.header_line, rules, types, lambda name, head: missing_column(name, head, known)
    )
    if found:
        raise TableError(path, found)
    return numbers.reset_index(drop=True)


def _in_order(count: int) -> Rule:
    return Rule(
        "member",
        ("member",),
        lambda t: (t["member"] != np.arange(1, count + 1)) | (t["member"] > MOST_MEMBERS),
        "is out of order: number the members 1, 2, … one below the other",
    )
