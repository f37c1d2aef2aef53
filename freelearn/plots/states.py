"""Which rows and kinematic states a picture shows."""

from __future__ import annotations

import numpy as np
import pandas as pd

PLACE = ["sample", "elongation_mm", "twist_deg"]
# A curve through fewer rows shows nothing.
ROWS_FOR_A_CURVE = 4


def usable(predictions: pd.DataFrame) -> pd.DataFrame:
    """Rows that are fitted or scored: not buckled, and with a valid prediction."""
    return predictions[(predictions["buckled"] == 0) & (predictions["status"] == "ok")]


def pick_states(predictions: pd.DataFrame, count: int = 3) -> list[tuple[int, float, float]]:
    """Kinematic states worth showing, (sample, elongation [mm], twist [deg]): from the best to the worst predicted.

    Of the states with at least four usable rows (or, if there is none, with the most rows), evenly spaced ranks of
    the mean squared error, so the first is the best and the last the worst.
    """
    rows = usable(predictions)
    if not len(rows):
        return []
    scale = rows[["force_n", "moment_nmm"]].abs().max().replace(0, 1)
    force = (rows["force_pred_n"] - rows["force_n"]) / scale["force_n"]
    moment = (rows["moment_pred_nmm"] - rows["moment_nmm"]) / scale["moment_nmm"]
    error = (force**2 + moment**2).groupby([rows[name] for name in PLACE]).agg(["mean", "size"])
    enough = error[error["size"] >= min(ROWS_FOR_A_CURVE, error["size"].max())]
    ranked = enough.sort_values("mean", kind="stable").index.to_list()
    chosen = np.unique(np.linspace(0, len(ranked) - 1, count).round().astype(int))
    return [ranked[i] for i in chosen]
