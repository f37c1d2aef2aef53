"""Which states an actuator reaches without buckling, as numbers."""

from __future__ import annotations

import pandas as pd

from freelearn.measurements.beds import Pair
from freelearn.results.states import fields


def admissible_table(table: pd.DataFrame, over: Pair | None = None) -> pd.DataFrame:
    """Each field's place, its number of rows and the share of them that did not buckle.

    Columns sample, those of the place, rows, share. over: see states.fields; by default each kinematic state is one."""
    number, where = fields(table, over)
    kept = (table["buckled"].reset_index(drop=True) == 0).groupby(number).agg(["size", "mean"])
    kept.columns = pd.Index(["rows", "share"])
    return where.join(kept.rename_axis("state")).reset_index(drop=True)


def sample_shares(table: pd.DataFrame) -> dict[int, float]:
    """Share of each sample's rows that did not buckle."""
    share = (table["buckled"] == 0).groupby(table["sample"]).mean()
    return {int(str(sample)): float(value) for sample, value in share.items()}
