"""Readings at the end of what their instrument reads, where a tube does more."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch

from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import Quantity, bed_of
from freelearn.data.columns import SLACK
from freelearn.data.piled import piled
from freelearn.data.rows import Rows
from freelearn.discovery.checks.plain_fit import Plain
from freelearn.discovery.checks.table_check import CANNOT, FAIL, PASS, TableCheck

NAME = "ends of range"
# Times that a column's end is read as often as any other value, and standard deviations of the instrument by which what
# the model says there differs, whether or not it is right: a held load is read again and again, too.
OFTEN, APART = 5.0, 10.0
# What the model says beyond such a reading, and how far what it says in these rows is apart, both as a multiple of what
# it errs of the other rows and of the instrument's standard deviation; and the share of these rows where it says more.
BEYOND, MOST = 3.0, 0.8


def ends_of_range(plain: Plain, accuracy: Accuracy) -> TableCheck:
    """Whether readings stand at the largest or smallest value of their column again and again, and at no other value
    nearly as often, or where the plain model, fitted to the other rows, goes on: what was there is not in the table,
    and each effect that bends a curve explains it."""
    doubtful = list(_piled(plain))
    if not doubtful:
        return TableCheck(NAME, PASS, None, None, "No reading stands at the end of its column again and again.")
    others = ~np.any([rows for _, _, rows in doubtful], axis=0)
    missed = _missed(plain, others)
    sure = [_sure(plain, each, others, missed, accuracy) for each in doubtful]
    told = [each for each, how in zip(doubtful, sure, strict=True) if how >= 1]
    if not told:
        says = "Readings stand at the end of their column again and again, and a tube of the other rows does no more."
        return TableCheck(NAME, CANNOT, max(sure), 1.0, says)
    where = " and ".join(f"{q.column} is {value:.5g} in {rows.sum()} rows" for q, value, rows in told)
    says = (
        f"{where}, as an instrument reads at its end, whatever a tube does: blank these readings, or write 1 into "
        "left_out of these rows."
    )
    return TableCheck(NAME, FAIL, max(sure), 1.0, says)


# What is measured, the value at its end, and the rows (N,) that read it.
Doubtful = tuple[Quantity, float, np.ndarray]


def _piled(plain: Plain) -> Iterator[Doubtful]:
    """Where a tube hangs loose its load cell reads what it does without one."""
    taut = plain.table[SLACK] != 1 if SLACK in plain.table else np.ones(len(plain.table), dtype=bool)
    for quantity in bed_of(plain.table).readings:
        if quantity.column in plain.table:
            values = plain.table[quantity.column].where(taut).to_numpy(np.float64)
            yield from ((quantity, end, values == end) for end, _ in piled(values))


def _sure(plain: Plain, doubtful: Doubtful, others: np.ndarray, missed: np.ndarray, accuracy: Accuracy) -> float:
    """How many times as much as would do tells that an instrument was at its end. others: rows without any doubtful
    reading, (N,); missed: see below."""
    quantity, end, at_end = doubtful
    missed = missed[:, bed_of(plain.table).readings.index(quantity)]
    values, there = plain.table[quantity.column].to_numpy(np.float64), np.isfinite(missed)
    more = np.sign(end - np.nanmedian(values)) * missed[at_end & there]
    if not len(more):
        return 0.0
    sigma = float(getattr(accuracy, quantity.error)) or 1e-300
    apart = float(np.subtract(*np.quantile(more, [0.9, 0.1])))
    counts = np.unique(values[others & (values != 0)], return_counts=True)[1]
    often = min(at_end.sum() / counts.max() / OFTEN, apart / sigma / APART)
    if (more > 0).mean() < MOST:
        return float(often)
    usual = max(float(np.sqrt(np.mean(missed[others & there] ** 2))), sigma)
    return float(max(often, min(np.median(more), apart) / usual / BEYOND))


def _missed(plain: Plain, others: np.ndarray) -> np.ndarray:
    """By how much the plain model of these rows goes beyond what all read (N, 2), SI; NaN where it says nothing."""
    fit = plain.of(plain.table[others].reset_index(drop=True))
    if not fit.values:
        return np.full((len(plain.table), 2), np.nan)
    rows = Rows.from_table(plain.table)
    with torch.no_grad():
        missed: np.ndarray = (plain.model(rows, fit.values)(rows.states).loads - rows.loads).numpy()
    return missed
