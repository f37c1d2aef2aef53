"""The rows of a file that a recipe keeps, their order, and which actuator each is of."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.intake.readers.raw_table import RawTable
from freelearn.data.intake.recipes.recipe import Cell, Condition, Part, Recipe, Sample, Test


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


def chosen_rows(recipe: Recipe, part: Part, raw: RawTable) -> RawTable:
    """The rows that are kept, in the order that the recipe asks for."""
    keep = meets(recipe.keep, raw) if recipe.keep else np.ones(len(raw), dtype=bool)
    for condition in (*recipe.drop, *part.drop):
        keep &= ~meets(condition, raw)
    if not keep.any():
        raise UserError(f"{raw.name}: keep and drop of the recipe leave no row.")
    raw = raw.rows(np.flatnonzero(keep))
    if not recipe.order_by:
        return raw
    keys = pd.DataFrame({str(i): _sortable(raw, name) for i, name in enumerate(recipe.order_by)})
    return raw.rows(keys.sort_values(list(keys), kind="stable").index.to_numpy())


def _sortable(raw: RawTable, name: str) -> np.ndarray | list[str]:
    values = raw.maybe_numbers(raw.known(name))
    return raw.text(name) if values is None else values


# Which actuator each row of a file is of, and what is constant for it.


def sample_numbers(sample: Sample, raw: RawTable) -> tuple[np.ndarray, dict[str, int]]:
    """The number of each row's actuator, (N,) int64, and the words that were translated. Raises UserError."""
    if sample.source is None:
        return np.full(len(raw), sample.number, dtype=np.int64), {}
    words = raw.text(sample.source)
    if sample.numbers is None:
        values = raw.maybe_numbers(raw.known(sample.source))
        if values is None or np.isnan(values).any() or (values % 1 != 0).any() or (values < 1).any():
            known = ", ".join(f"{w}: {i}" for i, w in enumerate(list(dict.fromkeys(words))[:4], start=1))
            raise UserError(
                f"{raw.name}: column {sample.source!r} holds no numbers of actuators: number its words with "
                f"sample: {{from: {sample.source}, as: {{{known}, …}}}}."
            )
        return values.astype(np.int64), {}
    unknown = sorted({word for word in words if _translated(word, sample.numbers, raw) is None})
    if unknown:
        raise UserError(f"{raw.name}: sample.as has no number for {', '.join(map(repr, unknown[:5]))}: add it.")
    numbers = [_translated(word, sample.numbers, raw) or 0 for word in words]
    return np.array(numbers, dtype=np.int64), dict(sample.numbers)


def _translated(word: str, numbers: Mapping[str, int], raw: RawTable) -> int | None:
    """40 and 40.0 are one word."""
    if word in numbers:
        return numbers[word]
    value = raw.style.number(word)
    return None if value is None or np.isnan(value) else numbers.get(f"{value:g}")


def constants_by_row(recipe: Recipe, part: Part, sample: np.ndarray) -> dict[str, np.ndarray]:
    """Constants for each row, (N,) each: a sample's before a file's before the recipe's. Raises UserError."""
    constants = {name: np.full(len(sample), value) for name, value in recipe.constants_for(part).items()}
    if recipe.samples:
        unknown = sorted(set(sample.tolist()) - set(recipe.samples))
        own = {name for of in recipe.samples.values() for name in of}
        for name in sorted(own):
            values = constants.get(name, np.full(len(sample), np.nan)).copy()
            for number, of in recipe.samples.items():
                if name in of:
                    values[sample == number] = of[name]
            if np.isnan(values).any():
                lacking = unknown or sorted(set(sample[np.isnan(values)].tolist()))
                raise UserError(f"samples of the recipe gives no {name} for sample {lacking[0]}: add it.")
            constants[name] = values
    return constants
