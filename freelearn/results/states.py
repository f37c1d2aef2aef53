"""Which rows and kinematic states a picture shows."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.measurements.sets import samples_of
from freelearn.measurements.states import kinematic_state
from freelearn.models.predicted import usable
from freelearn.results.run import CONSTITUENT_SET

# A curve through fewer rows shows nothing.
ROWS_FOR_A_CURVE = 4


def rows_of_set(table: pd.DataFrame, name: str) -> pd.DataFrame:
    """Rows of the samples in a named set; all rows for the set that names no samples. Raises UserError."""
    if name == CONSTITUENT_SET:
        return table
    sample = table["sample"].to_numpy()
    return table[np.isin(sample, samples_of(name, sample))]


def places(table: pd.DataFrame) -> pd.DataFrame:
    """One row per kinematic state, in order: sample, elongation_mm (mean: a bed may creep), twist_deg; index `state`.

    States are numbered as `kinematic_state` numbers those of `table`.
    """
    columns = table[["sample", "elongation_mm", "twist_deg"]]
    each = columns.groupby(kinematic_state(table))
    return each.agg({"sample": "first", "elongation_mm": "mean", "twist_deg": "first"}).rename_axis("state")


def state_title(measured: pd.DataFrame) -> str:
    """What one state's rows are called. Plain hyphens: it also names files and TensorBoard's images."""
    first = measured.iloc[0]
    elongation = measured["elongation_mm"].mean()
    return f"sample {first['sample']:.0f}, {elongation:+.3g} mm, {first['twist_deg']:+.4g}°"


def squared_error(predictions: pd.DataFrame) -> pd.Series:
    """((F−F̂)/max|F|)² + ((M−M̂)/max|M|)² of each usable row, over the largest loads among them."""
    rows = usable(predictions)
    scale = rows[["force_n", "moment_nmm"]].abs().max().replace(0, 1)
    force = (rows["force_pred_n"] - rows["force_n"]) / scale["force_n"]
    moment = (rows["moment_pred_nmm"] - rows["moment_nmm"]) / scale["moment_nmm"]
    return force**2 + moment**2


def pick_states(predictions: pd.DataFrame, count: int = 3) -> list[np.ndarray]:
    """Positions of all rows, in time order, of kinematic states worth showing: from the best to the worst predicted.

    Of the states with at least four usable rows (or, if there is none, with the most rows), evenly spaced ranks of
    the mean squared error, so the first is the best and the last the worst.
    """
    predictions = predictions.reset_index(drop=True)
    state = pd.Series(kinematic_state(predictions))
    each = squared_error(predictions)
    if not len(each):
        return []
    error = each.groupby(state[each.index]).agg(["mean", "size"])
    enough = error[error["size"] >= min(ROWS_FOR_A_CURVE, error["size"].max())]
    ranked = enough.sort_values("mean", kind="stable").index.to_numpy()
    chosen = np.unique(np.linspace(0, len(ranked) - 1, count).round().astype(int))
    return [np.flatnonzero(state == ranked[i]) for i in chosen]
