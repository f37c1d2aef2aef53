"""The parameters of many runs, and how far they move."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from freelearn.measurements.members import DESIGN
from freelearn.results.record import RunRecord

COLUMNS = ["model", "train", "seed", "parameter", "value", "stderr", "unit"]


def fitted_parameters(records: Sequence[RunRecord]) -> pd.DataFrame:
    """One row per fitted run and physical parameter, in COLUMNS (SI); weights of a network have no unit and no row."""
    rows = [
        [record.title, record.train, record.seed, e.name, e.value, e.stderr, e.unit]
        for record in records
        for e in record.estimates
        if e.unit and record.method != "none"
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def parameter_spread(fitted: pd.DataFrame) -> pd.DataFrame:
    """How far each parameter moves between runs: least, median and largest value, number of fits, and the largest over
    the least. fitted: of fitted_parameters."""
    moved = fitted.groupby(["model", "parameter", "unit"], sort=False)["value"].agg(["min", "median", "max", "size"])
    moved["max / min"] = (moved["max"] / moved["min"]).where(moved["min"] > 0)
    return moved.rename(columns={"size": "fits"}).reset_index()


def design_table(table: pd.DataFrame) -> pd.DataFrame:
    """The actuators of a measurement table, by sample: design, rows and un-buckled rows."""
    counts = table.groupby("sample")["buckled"].agg(rows="size", unbuckled=lambda buckled: int((buckled == 0).sum()))
    designs = table[["sample", *DESIGN]].drop_duplicates("sample").sort_values("sample")
    return designs.merge(counts, left_on="sample", right_index=True)
