"""Tables that can tell nothing of what a model misses, whatever is fitted to them."""

from __future__ import annotations

import numpy as np

from freelearn.inference.question import Question
from freelearn.inference.referee.check import CANNOT, Check
from freelearn.inference.shapes import imposed

# Readings for each number of the model before anything is added, and one more.
READINGS_EACH = 2
# Rows of a single kinematic state that let anything be told from a line.
ROWS_OF_ONE_STATE = 24


def scant(question: Question) -> Check | None:
    """Why no search can tell anything of the rows, if so: too few readings, one state with few rows, or nothing that
    varies."""
    rows = question.rows
    needed = READINGS_EACH * (len(question.build(list(question.given)).vector()) + 1)
    if rows.readings.count < needed:
        many = f"{len(rows)} row{'s' * (len(rows) != 1)} with {rows.readings.count} readings"
        says = f"{many}: too few to look for a missing effect."
        return _check(rows.readings.count, needed, says)
    inputs = [x.numpy() for x in imposed(rows.states).values()]
    if all(np.ptp(x) <= 1e-9 * max(float(np.abs(x).max()), 1e-300) for x in inputs):
        return _check(1, 2, "Nothing that the bed imposes varies in these rows: measure at other states and pressures.")
    if len(np.unique(rows.state)) == 1 and len(rows) < ROWS_OF_ONE_STATE:
        says = f"{len(rows)} rows of a single kinematic state tell no effect from another: measure at other states."
        return _check(len(rows), ROWS_OF_ONE_STATE, says)
    return None


def _check(figure: float, threshold: float, says: str) -> Check:
    return Check("enough rows", CANNOT, figure, threshold, says)
