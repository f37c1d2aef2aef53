"""Which states an actuator reaches without buckling, as numbers."""

from __future__ import annotations

import pandas as pd

from freelearn.measurements.states import kinematic_state
from freelearn.results.states import places


def admissible_table(table: pd.DataFrame) -> pd.DataFrame:
    """Each kinematic state's place, its number of rows and the share of them that did not buckle.

    Columns sample, elongation_mm, twist_deg, rows, share."""
    state = kinematic_state(table)
    kept = (table["buckled"].reset_index(drop=True) == 0).groupby(state).agg(["size", "mean"])
    kept.columns = pd.Index(["rows", "share"])
    return places(table).join(kept.rename_axis("state")).reset_index(drop=True)


def sample_shares(table: pd.DataFrame) -> dict[int, float]:
    """Share of each sample's rows that did not buckle."""
    share = (table["buckled"] == 0).groupby(table["sample"]).mean()
    return {int(str(sample)): float(value) for sample, value in share.items()}
