"""Where over length and twist a model is wrong, as numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from freelearn.measurements.states import kinematic_state
from freelearn.models.predicted import usable
from freelearn.results.states import places

# Samples shown side by side; more of them would be too narrow to read.
MOST_SAMPLES = 8


class Load(NamedTuple):
    """One of the two loads. column, predicted: in predictions.csv; symbol, unit: on axes."""

    column: str
    predicted: str
    name: str
    symbol: str
    unit: str

    @property
    def label(self) -> str:
        """For an axis: force F [N]."""
        return f"{self.name} {self.symbol} [{self.unit}]"


FORCE = Load("force_n", "force_pred_n", "force", "F", "N")
MOMENT = Load("moment_nmm", "moment_pred_nmm", "moment", "M", "N·mm")
LOADS = (FORCE, MOMENT)


def residual_table(predictions: pd.DataFrame) -> pd.DataFrame:
    """Each kinematic state's place and, over its usable rows, mean measured − predicted force [N] and moment [N·mm]
    (blank without one) and their number `rows`. Columns sample, elongation_mm, twist_deg, force_n, moment_nmm, rows.

    predictions: columns of predictions.csv."""
    predictions = predictions.reset_index(drop=True)
    state = pd.Series(kinematic_state(predictions))
    rows = usable(predictions)
    residual = pd.DataFrame({load.column: rows[load.column] - rows[load.predicted] for load in LOADS})
    grouped = residual.groupby(state[rows.index])
    means = grouped.mean().assign(rows=grouped.size()).rename_axis("state")
    return places(predictions).join(means).fillna({"rows": 0}).reset_index(drop=True)


def scale_end(values: ArrayLike) -> float:
    """The end of a color scale that is symmetric about zero; 1 where there is nothing to show.

    >>> scale_end([-3.0, 2.0, float("nan")]), scale_end([])
    (3.0, 1.0)
    """
    size = np.abs(np.asarray(values, dtype=np.float64))
    size = size[np.isfinite(size)]
    return float(size.max()) if len(size) and size.max() > 0 else 1.0


def limit_text(limit: float, unit: str) -> str:
    """What stands at a sample whose colors end at ± limit.

    >>> limit_text(123.4, "N·mm")
    '± 120 N·mm'
    """
    return f"± {float(f'{limit:.2g}'):g} {unit}"


def shown_samples(table: pd.DataFrame) -> tuple[list[int], str]:
    """The samples that a picture shows, and which ones these are, in words; "" for all of them."""
    present = [int(number) for number in np.sort(table["sample"].unique())]
    shown = present[:MOST_SAMPLES]
    return shown, f"first {len(shown)} of {len(present)} samples" if len(present) > len(shown) else ""
