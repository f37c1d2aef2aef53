"""What is said about columns whose numbers suggest another unit than their names say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pandas as pd

from freelearn.measurements.beds import FORCE, bed_of
from freelearn.measurements.log import is_log
from freelearn.measurements.unit_checks import CHECKS, FORCE_NEEDS, force_unit
from freelearn.measurements.usable import used_rows


class UnitWarning(str):
    """A suspicion that a column is in another unit: what is computed from it means nothing until somebody looks."""


def units_apart(warnings: Sequence[str]) -> tuple[list[str], list[str]]:
    """Those about units, and the others.

    >>> units_apart(["a blank column", UnitWarning("in psi")])
    (['in psi'], ['a blank column'])
    """
    return (
        [warning for warning in warnings if isinstance(warning, UnitWarning)],
        [warning for warning in warnings if not isinstance(warning, UnitWarning)],
    )


def unit_warnings(table: pd.DataFrame) -> list[str]:
    """A sentence for each suspicion about a checked measurement table, with the value after conversion: a UnitWarning
    where it is about a unit.

    Suspicions only: nothing is converted, and an unusual actuator may be right as it is.
    """
    used = used_rows(table)
    # A bed need not have every column; one that it does not know stays text.
    numbers = used.select_dtypes("number").dropna(axis=1, how="all")
    found = [warning for needs, check in CHECKS.items() if set(needs) <= set(numbers) for warning in check(numbers)]
    # Beside a column that is suspected itself, the force tells nothing.
    if FORCE in bed_of(used).measured and set(FORCE_NEEDS) <= set(numbers) and not _about(found, FORCE_NEEDS):
        found += force_unit(numbers)
    return [*map(UnitWarning, found), *([] if is_log(used) else _step(used))]


def _about(sentences: Sequence[str], columns: Sequence[str]) -> bool:
    return any(sentence.startswith(f"{column} ") for sentence in sentences for column in columns)


def _step(used: pd.DataFrame) -> Iterator[str]:
    state = [quantity.column for quantity in bed_of(used).state]
    states = used.groupby(["sample", *state], sort=False)
    # Several visits of one place, each with a step of its own, count nowhere either.
    if (states["step"].nunique() > 1).any():
        return
    pressures = states["pressure_kpa"].nunique()
    if (pressures > 1).any():
        same = used["step"].iloc[0] if used["step"].nunique() == 1 else None
        yield (
            f"step {'never changes' if same is None else f'is {same} in every row'} although a kinematic state has up "
            f"to {pressures.max()} pressures: count 0, 1, … in time within each state, so that rising and falling "
            "pressure can be told apart."
        )
