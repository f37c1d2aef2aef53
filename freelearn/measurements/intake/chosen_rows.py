"""The rows of a file that a recipe keeps, and their order."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.errors import UserError
from freelearn.measurements.intake.conditions import meets
from freelearn.measurements.intake.raw_table import RawTable
from freelearn.measurements.intake.recipe import Part, Recipe


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
