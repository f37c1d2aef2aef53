"""A table of states or questions as it came, seen to be numbers, with what its rows leave to the run to say."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.beds import BED, BEDS, ELONGATION, FORCE, MOMENT, TWIST, bed_of
from freelearn.data.columns import DESIGN, SECOND, members_in, pressure_column, pressure_columns
from freelearn.data.table.log_tables import log_faults

QUANTITIES = {q.column for bed in BEDS.values() for q in (*bed.state, *bed.readings)}
ORDER = ("sample", "step", "time_s")
# Force and moment: so many of five quantities may be blank.
EQUATIONS = 2


def as_numbers(table: pd.DataFrame, design: Sequence[str], members: Sequence[int]) -> pd.DataFrame:
    """The columns that mean something as float64, NaN where blank; others as they are. Raises UserError.

    design: columns of the design. members: of the run's end block."""
    table = table.reset_index(drop=True)
    twice = table.columns[table.columns.duplicated()]
    if len(twice):
        raise UserError(f"The column {twice[0]} appears {(table.columns == twice[0]).sum()} times: keep one.")
    own = pressure_columns(members)
    strange = [pressure_column(m) for m in members_in(table.columns) if m not in members]
    if strange:
        raise UserError(
            f"No actuator of the run has the pressure {strange[0]}: rename the column, it has {', '.join(own)}."
        )
    known = {*QUANTITIES, *ORDER, *DESIGN, SECOND, *design, "pressure_kpa", *own}
    numbers = {name: _numbers(table[name], str(name)) for name in table if name in known}
    if "sample" in numbers and bool((numbers["sample"] % 1 != 0)[numbers["sample"].notna()].any()):
        raise UserError("A sample is no whole number: number the actuators 1, 2, …")
    # What is measured where is said by the run.
    return table.assign(**numbers).drop(columns=[BED], errors="ignore")


def _numbers(column: pd.Series, name: str) -> pd.Series:
    numbers = pd.to_numeric(column, errors="coerce").astype(np.float64)
    written = column.notna() & (column.astype(str).str.strip() != "")
    wrong = np.flatnonzero((written & ~np.isfinite(numbers)).to_numpy(dtype=bool))
    if len(wrong):
        raise UserError(f"Row {wrong[0] + 1}, {name}: {str(column.iloc[wrong[0]])!r} is not a finite number.")
    return numbers


def with_held(table: pd.DataFrame, known: pd.DataFrame, loads: bool) -> pd.DataFrame:
    """The table with what the run's bed never moved, a muscle's twist, where rows leave it blank: held as it was there.

    known: the run's rows. loads: whether only the loads at a state are asked for. Else in rows that leave more blank
    than two equations can tell."""
    if table.columns.duplicated().any():
        return table  # as_numbers says so
    mechanical = (ELONGATION, TWIST, FORCE, MOMENT)
    blank = {q: _blank(table, q.column) for q in mechanical}
    pressures = [name for name in table if str(name).startswith("pressure")]
    unknown = sum(blank.values()) + pd.concat([_blank(table, name) for name in pressures or [""]], axis=1).any(axis=1)
    # The twist first: that a length was never changed is rarer, and what is asked for more often.
    for quantity in reversed(bed_of(known).state):
        there = known[quantity.column]
        lost = blank[quantity] & (True if loads else unknown > EQUATIONS)
        if there.nunique(dropna=False) == 1 and lost.any():
            own = table.get(quantity.column, pd.Series(np.nan, table.index))
            table = table.assign(**{quantity.column: own.mask(lost, float(there.iloc[0]))})
            unknown = unknown - lost
    return table


def _blank(table: pd.DataFrame, name: str) -> pd.Series:
    """Rows that leave a column blank, (N,) bool."""
    return pd.to_numeric(table[name], errors="coerce").isna() if name in table else pd.Series(True, table.index)


def in_time(table: pd.DataFrame) -> None:
    """Raises UserError where the rows of a log's recordings do not follow each other in time."""
    for fault in log_faults(table, np.arange(1, len(table) + 1), fewest=1):
        raise UserError(f"Row {fault.line}, {fault.column}: {fault.value} {fault.problem}.")


def with_design(table: pd.DataFrame, known: pd.DataFrame) -> pd.DataFrame:
    """The table with every row's design; what a row leaves blank of it is its sample's. Raises UserError.

    known: the run's samples with their design. A row whose design is whole has no second family unless it says so."""
    names = [str(name) for name in known if name != "sample"]
    needed = [name for name in names if not name.startswith(SECOND.split("_")[0])]
    short = table.reindex(columns=needed).isna().any(axis=1)
    if not short.any():
        return table.assign(**{name: np.nan for name in names if name not in table})
    samples = known["sample"].tolist()
    if "sample" not in table:
        if len(samples) > 1:
            raise UserError(
                f"The run has the samples {', '.join(map(str, samples))}: say in a column sample which is meant."
            )
        table = table.assign(sample=short.map({True: float(samples[0]), False: np.nan}))
    named = table.loc[short, "sample"]
    if named.isna().any():
        raise UserError("A row names no sample: fill in the column sample, or give the design in each row.")
    unknown = sorted(set(named) - set(samples))
    if unknown:
        raise UserError(f"The run has no sample {unknown[0]:g}: give the design's columns {', '.join(names)}.")
    own = known.set_index("sample")
    blank = pd.Series(np.nan, index=table.index)
    filled = {}
    for name in names:
        given = table.get(name, blank)
        filled[name] = given.where(given.notna() | ~short, table["sample"].map(own[name]))
    return table.assign(**filled)


def leaves_length(table: pd.DataFrame, members: Collection[int]) -> None:
    """Raises UserError where an elongation leaves an actuator no length."""
    if "elongation_mm" not in table:
        return
    lengths = [f"length_{m}_mm" for m in members] or ["length_mm"]
    shortest = table[[name for name in lengths if name in table]].min(axis=1)
    none = np.flatnonzero((table["elongation_mm"] <= -shortest).to_numpy())
    if len(none):
        place, value, length = none[0] + 1, table["elongation_mm"].iloc[none[0]], shortest.iloc[none[0]]
        raise UserError(f"Row {place}, elongation_mm: {value:g} leaves nothing of a length of {length:g} mm.")
