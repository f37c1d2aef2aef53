"""Rows of a measurement table that look wrong by themselves: said, never changed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from freelearn.data.beds import bed_of
from freelearn.data.columns import Columns, usable_rows
from freelearn.data.logs import is_log

# Nearly all readings are below this quantile of their sizes; the largest may have slipped.
NEARLY_ALL = 0.95
# So many times that size no reading is; what is imposed may be next to nothing in nearly all rows.
READ_APART, IMPOSED_APART = 100.0, 1000.0
SHOWN = 3


def row_suspicions(table: pd.DataFrame, lines: np.ndarray) -> list[str]:
    """A sentence for each suspicion about a checked table's rows. lines: of the rows in the file, (N,) int64."""
    return [*_backwards(table, lines), *_apart(table, lines)]


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
