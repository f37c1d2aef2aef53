"""Every column of the table that a recipe makes of one file's rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.intake.evaluate import Evaluation
from freelearn.measurements.intake.recipe import Recipe
from freelearn.measurements.members import pressure_column

# Columns that rows carry until the table is assembled.
FILE, LINE, ANEW = "file", "line", "anew "


def at_rest(recipe: Recipe, rows: Evaluation) -> np.ndarray | None:
    """Rows by which `offset: rest` is measured, (N,) bool; None where the recipe has none."""
    if recipe.rest is None:
        return None
    if recipe.rest == "first":
        first = np.zeros(len(rows.raw), dtype=bool)
        first[np.unique(rows.sample, return_index=True)[1]] = True
        return first
    return rows.where(recipe.rest)


def quantities(recipe: Recipe, rows: Evaluation) -> pd.DataFrame:
    """Every column of the table but the step, in no particular order."""
    columns: dict[str, Any] = {"sample": rows.sample}
    for name in (*rows.columns, *rows.constants):
        columns[name] = rows.quantity(name)
    for number, member in enumerate(recipe.members, start=1):
        name = pressure_column(number)
        rows.made[name] = columns[name] = rows.make(name, member.pressure)
    if recipe.steps.source is not None:
        columns["step"] = rows.raw.numbers(recipe.steps.source)
    for mark, condition in recipe.marks.items():
        columns[mark] = rows.where(condition).astype(np.int64)
    columns |= {f"{ANEW}{name}": rows.raw.text(name) for name in recipe.steps.anew}
    columns |= {_carried(name, columns): rows.raw.text(name) for name in recipe.carry}
    return pd.DataFrame(columns | {FILE: rows.raw.name, LINE: rows.raw.lines})


def _carried(name: str, columns: Mapping[str, Any]) -> str:
    if name in columns:
        raise UserError(f"carry: {name!r} is already a column of the table: leave it out of carry.")
    return name
