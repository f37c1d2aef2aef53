"""Rows of a measurement table that look wrong by themselves: said, never changed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from freelearn.data.beds import bed_of
from freelearn.data.columns import Columns, usable_rows
from freelearn.data.logs import RUN, is_log, run_numbers

# Nearly all readings are below this quantile of their sizes; the largest may have slipped.
NEARLY_ALL = 0.95
# So many times that size no reading is; what is imposed may be next to nothing in nearly all rows.
READ_APART, IMPOSED_APART = 100.0, 1000.0
SHOWN = 3


def row_suspicions(table: pd.DataFrame, lines: np.ndarray) -> list[str]:
    """A sentence for each suspicion about a checked table's rows. lines: of the rows in the file, (N,) int64."""
    return [*_backwards(table, lines), *_unread(table, lines), *_apart(table, lines)]


def _backwards(table: pd.DataFrame, lines: np.ndarray) -> Iterator[str]:
    """Time that runs backwards in a sample, buckled rows and those left out included: the rubber remembers them."""
    if "time_s" not in table or table["time_s"].isna().any():
        return
    if is_log(table):
        # Each recording has a time of its own.
        return
    back = table.groupby("sample", sort=False)["time_s"].diff().to_numpy() < 0
    if back.any():
        yield (
            f"time_s runs backwards at line {lines[back][0]} ({back.sum()} times in all): put each sample's rows in "
            "the order of time with one clock, or leave the column out, for effects with a memory go by it."
        )


def _unread(table: pd.DataFrame, lines: np.ndarray) -> Iterator[str]:
    """Recordings of a log in which nothing was read at all, of those with rows that may be fitted."""
    if not is_log(table):
        return
    measured = [quantity.column for quantity in bed_of(table).measured if quantity.column in table]
    used, run = usable_rows(table), run_numbers(table)
    read = used & table[measured].notna().any(axis=1).to_numpy()
    lost = np.unique(run[used])
    lost = lost[~np.isin(lost, run[read])]
    if len(lost):
        first = np.flatnonzero(run == lost[0])
        more = f", nor in {len(lost) - 1} more" if len(lost) > 1 else ""
        yield (
            f"run {table[RUN].iloc[first[0]]} ({len(first)} rows from line {lines[first[0]]}) has no reading in any "
            f"row{more}: nothing is fitted or scored by it; fill in {' or '.join(measured)}, or delete the run."
        )


def _apart(table: pd.DataFrame, lines: np.ndarray) -> Iterator[str]:
    """Readings far larger than nearly all others of their column."""
    used = usable_rows(table)
    bed = bed_of(table)
    measured = [quantity.column for quantity in bed.measured]
    for name in (*measured, *Columns.from_table(table).imposed):
        if name not in table:
            continue
        sizes = table[name].abs().to_numpy(np.float64)
        there = sizes[used & np.isfinite(sizes)]
        usual = float(np.quantile(there, NEARLY_ALL, method="lower")) if len(there) else 0.0
        far = used & (sizes > (READ_APART if name in measured else IMPOSED_APART) * usual)
        if usual > 0 and far.any():
            shown = ", ".join(f"line {line}" for line in lines[far][:SHOWN]) + (
                " and others" if far.sum() > SHOWN else ""
            )
            largest = sizes[far].max()
            yield (
                f"{name} on {shown} is up to {largest / usual:.2g} times as large as nearly all others "
                f"({largest:.4g} beside {usual:.4g}): look for a slipped unit or decimal point, or write 1 in a column "
                "left_out there."
            )
