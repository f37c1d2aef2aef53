"""Readings that a recipe knows to be wrong."""

from __future__ import annotations

from typing import Any

import numpy as np

from freelearn.errors import UserError
from freelearn.measurements.intake.recipe import Column


def corrected(name: str, column: Column, raw: np.ndarray, record: dict[str, Any]) -> np.ndarray:
    """A column's readings (N,) with those put right. name: of the file. record: tells what was done.

    Raises UserError where nothing reads what is to be corrected.
    """
    if not column.correct:
        return raw
    right = raw.copy()
    for wrong, value in column.correct:
        if not (raw == wrong).any():
            raise UserError(f"{name}: column {column.source!r} nowhere reads {wrong:g}, which the recipe corrects.")
        right[raw == wrong] = value
    record["corrected"] = {f"{wrong:g}": value for wrong, value in column.correct}
    return right
