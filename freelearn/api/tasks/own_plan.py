"""A plan of a user's own: its rows, and where they go beyond the bed's reach."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.beds import BED
from freelearn.data.columns import Columns
from freelearn.data.logs import RUN, TIME, is_log
from freelearn.data.table.faults import Fault, TableError
from freelearn.data.table.questions import faults_of_given
from freelearn.data.table.records import columns_of, numbers_of, read_records

# What else of a row counts, where the file says it.
NEEDED = ("sample", "step")
# How far a row may lie outside what the bed went to, as a share of that.
OUTSIDE = 1e-6


def read_plan(path: Path, measured: pd.DataFrame) -> pd.DataFrame:
    """The rows of a plan in the columns of a measured table: where to measure is the file's, what the sample is the
    table's. Raises UserError."""
    records = read_records(path)
    header = [name.strip() for name in records.header]
    needed = (*NEEDED, TIME, RUN) if is_log(measured) else NEEDED
    wanted = [*needed, *Columns.from_table(measured).imposed]
    if lacking := [name for name in wanted if name not in header]:
        raise UserError(f"{path} lacks the columns {', '.join(lacking)}: a plan says where to measure.")
    if not records.rows:
        raise UserError(f"{path} holds no rows: there is only a header.")
    cells, lines, faults = columns_of(records, header)
    if not faults:
        numbers = pd.DataFrame(
            {name: numbers_of(cells[name]) for name in wanted}, index=pd.Index(lines, dtype=np.int64)
        )
        for name in wanted:
            for i in np.flatnonzero(numbers[name].isna()).tolist():
                faults.append(Fault(lines[i], name, cells[name][i], "is no number: say where to measure"))
        faults = faults or faults_of_given(numbers, cells, records.header_line, wanted)
    if faults:
        raise TableError(path, sorted(faults, key=lambda fault: fault.line))
    return _completed(path, numbers.reset_index(drop=True), measured)


def _completed(path: Path, numbers: pd.DataFrame, measured: pd.DataFrame) -> pd.DataFrame:
    known = measured.drop_duplicates("sample").set_index("sample")
    unknown = sorted(set(numbers["sample"]) - set(known.index))
    if unknown:
        there = ", ".join(str(n) for n in known.index)
        raise UserError(f"{path} plans sample {unknown[0]:g}, which the run has not: it has {there}.")
    rows = known.loc[numbers["sample"]].reset_index()
    for name in numbers:
        rows[name] = numbers[name].to_numpy()
    columns = Columns.from_table(measured)
    if columns.members:
        rows["pressure_kpa"] = rows[list(columns.pressures)].mean(axis=1)
    if not is_log(measured):
        rows = rows.drop(columns=[TIME], errors="ignore")
    return rows.astype({"sample": np.int64, "step": np.int64})[[c for c in measured if c in rows or c == BED]]


def outside_reach(rows: pd.DataFrame, candidates: pd.DataFrame) -> list[str]:
    """A sentence for every column in which a plan goes beyond what the bed went to."""
    notes = []
    for name in Columns.from_table(rows).imposed:
        low, high = float(candidates[name].min()), float(candidates[name].max())
        room = OUTSIDE * max(high - low, abs(high), abs(low))
        count = int(((rows[name] < low - room) | (rows[name] > high + room)).sum())
        if count:
            where = f"{low:g} … {high:g}, where the bed went"
            notes.append(f"{count} of {len(rows)} rows lie outside the reach: {name} is not within {where}")
    return notes
