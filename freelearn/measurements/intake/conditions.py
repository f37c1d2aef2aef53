"""Which rows meet a condition of a recipe."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from freelearn.errors import UserError
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.recipe import Cell, Condition, Test


def meets(condition: Condition, raw: RawTable, table: Mapping[str, np.ndarray] | None = None) -> np.ndarray:
    """Rows that meet all tests, (N,) bool.

    table: columns that are made already, for conditions that may name them; a column of the file goes first. Raises
    UserError where a column is nowhere, or a number is asked of a text.
    """
    result = np.ones(len(raw), dtype=bool)
    for name, test in condition.items():
        if table is not None and name in table and name not in raw.columns:
            result &= _numeric(test, table[name])
        else:
            result &= _raw(test, raw, name)
    return result


def _raw(test: Test, raw: RawTable, name: str) -> np.ndarray:
    text = raw.text(name)
    result = np.ones(len(raw), dtype=bool)
    if test.below is not None or test.above is not None:
        result &= _numeric(Test(below=test.below, above=test.above), raw.numbers(name))
    if test.blank is not None:
        values = [raw.style.number(cell) for cell in text]
        result &= np.array([value is not None and np.isnan(value) for value in values]) == test.blank
    if test.is_:
        result &= np.array([any(_same(cell, one, raw) for one in test.is_) for cell in text])
    if test.is_not:
        result &= np.array([not any(_same(cell, one, raw) for one in test.is_not) for cell in text])
    return result


def _same(cell: str, wanted: Cell, raw: RawTable) -> bool:
    if isinstance(wanted, str):
        return cell == wanted
    value = raw.style.number(cell)
    return value is not None and bool(np.isclose(value, wanted, rtol=1e-12, atol=0.0))


def _numeric(test: Test, values: np.ndarray) -> np.ndarray:
    """A blank is neither below nor above anything."""
    result = np.ones(len(values), dtype=bool)
    if test.below is not None:
        result &= values < test.below
    if test.above is not None:
        result &= values > test.above
    if test.blank is not None:
        result &= np.isnan(values) == test.blank
    for wanted, inside in ((test.is_, True), (test.is_not, False)):
        if any(isinstance(one, str) for one in wanted):
            raise UserError(f"A column of the table holds numbers, and {wanted[0]!r} is a text: write a number.")
        if wanted:
            result &= np.isin(values, np.array(wanted, dtype=np.float64)) == inside
    return result
