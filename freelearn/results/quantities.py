"""Which quantities of a table its pictures and tables show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd
import torch

from freelearn.measurements.beds import ELONGATION, FORCE, MOMENT, PRESSURE, Pair, Quantity, bed_of
from freelearn.measurements.members import members_in, pressure_column
from freelearn.measurements.rows import Readings


def told(table: pd.DataFrame) -> tuple[Quantity, ...]:
    """What the bed measures and the table has a number of."""
    return tuple(q for q in bed_of(table).measured if q.column in table and table[q.column].notna().any())


def words(quantities: Sequence[Quantity]) -> str:
    """What a heading calls them.

    >>> words((FORCE, MOMENT)), words((FORCE,))
    ('Loads', 'Force')
    """
    if tuple(quantities) == (FORCE, MOMENT):
        return "Loads"
    return " and ".join(quantity.name for quantity in quantities).capitalize()


def digits(quantity: Quantity) -> int:
    """Significant digits of a place: a bed that creeps makes more of a length meaningless."""
    return 3 if quantity is ELONGATION else 4


def pressures(table: pd.DataFrame) -> tuple[Quantity, ...]:
    """The imposed pressures: that of the actuator, or of each one on the end block."""
    return tuple(map(pressure_of, members_in(table.columns))) or (PRESSURE,)


def pressure_of(member: int) -> Quantity:
    """The pressure of one actuator on an end block."""
    return replace(PRESSURE, column=pressure_column(member), symbol=f"P{member}")


def plane(table: pd.DataFrame) -> Pair:
    """The two quantities over which a picture shows the table: the first two imposed ones that vary, and where fewer
    do, the first of the others."""
    imposed = (*bed_of(table).state, *pressures(table))
    ranked = sorted(imposed, key=lambda quantity: table[quantity.column].nunique() <= 1)
    first, second = sorted(ranked[:2], key=imposed.index)
    return first, second


def misses(rows: pd.DataFrame) -> pd.DataFrame:
    """Measured − predicted of each row, in the columns and units of what was measured; blank where nothing was, and
    zero for a push on a tube that hangs loose. rows: columns of predictions.csv, with valid predictions."""
    readings, bed = Readings.from_table(rows), bed_of(rows)
    missed = readings.missed(Readings.from_table(rows, predicted=True).value)
    shown = torch.where(readings.present, -missed, torch.nan).numpy()
    return pd.DataFrame(
        {q.column: shown[:, i] / q.factor for i, q in enumerate(bed.readings) if q in bed.measured}, index=rows.index
    )
