"""Measured loads over the kinematic plane, before any model, as numbers."""

from __future__ import annotations

import pandas as pd

from freelearn.measurements.states import kinematic_state
from freelearn.measurements.usable import usable_rows
from freelearn.results.states import places

COLUMNS = ["sample", "elongation_mm", "twist_deg", "end", "pressure_kpa", "force_n", "moment_nmm"]


def load_vector_table(table: pd.DataFrame) -> pd.DataFrame:
    """Each kinematic state's place, and its loads at the lowest and the highest usable pressure; of rows with both.

    Columns sample, elongation_mm, twist_deg, end (low, high), pressure_kpa, force_n, moment_nmm."""
    table = table.reset_index(drop=True)
    where = places(table)
    kept = table[usable_rows(table) & table[["force_n", "moment_nmm"]].notna().all(axis=1).to_numpy()]
    pressure = kept["pressure_kpa"].groupby(pd.Series(kinematic_state(table))[kept.index])
    ends = []
    for end, place in (("low", pressure.idxmin()), ("high", pressure.idxmax())):
        loads = table.loc[place, ["pressure_kpa", "force_n", "moment_nmm"]].set_axis(place.index)
        ends.append(where.loc[place.index].join(loads).assign(end=end))
    return pd.concat(ends, ignore_index=True)[COLUMNS]
