"""Where over what is imposed a model is wrong, as numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from freelearn.measurements.beds import Pair, bed_of, behind
from freelearn.models.predicted import usable
from freelearn.results.quantities import misses
from freelearn.results.states import fields

# Samples shown side by side; more of them would be too narrow to read.
MOST_SAMPLES = 8


def residual_table(predictions: pd.DataFrame, over: Pair | None = None) -> pd.DataFrame:
    """Each field's place and, over its usable rows, the mean of measured − predicted of all that the bed measures
    (blank without one) and their number `rows`. Columns sample, those of the place, those of the quantities, rows.

    predictions: columns of predictions.csv. over: see states.fields; by default each kinematic state is a field."""
    predictions = predictions.reset_index(drop=True)
    number, where = fields(predictions, over)
    rows = usable(predictions)
    residual = misses(rows).reindex(columns=[q.column for q in bed_of(predictions).measured])
    read = residual[residual.notna().any(axis=1)]
    grouped = read.groupby(pd.Series(number)[read.index])
    means = grouped.mean().assign(rows=grouped.size()).rename_axis("state")
    return where.join(means).fillna({"rows": 0}).reset_index(drop=True)


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

    >>> limit_text(123.4, "N·mm"), limit_text(2.0, "°")
    ('± 120 N·mm', '± 2°')
    """
    return f"± {float(f'{limit:.2g}'):g}{behind(unit)}"


def shown_samples(table: pd.DataFrame) -> tuple[list[int], str]:
    """The samples that a picture shows, and which ones these are, in words; "" for all of them."""
    present = [int(number) for number in np.sort(table["sample"].unique())]
    shown = present[:MOST_SAMPLES]
    return shown, f"first {len(shown)} of {len(present)} samples" if len(present) > len(shown) else ""
