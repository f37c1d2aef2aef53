"""Predicted against measured loads, as numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.measurements.sets import TEST, TRAIN, VALIDATION
from freelearn.models.predicted import usable
from freelearn.results.residuals import LOADS

SPLITS = (TRAIN, VALIDATION, TEST)
# More points than this per split only darken the picture.
SHOWN = 3000
COLUMNS = ["sample", "elongation_mm", "twist_deg", "pressure_kpa", "split"]


def parity_numbers(predictions: pd.DataFrame) -> pd.DataFrame:
    """The rows shown: usable ones, at most SHOWN of each split, with their places and both kinds of loads.

    Drawn at random, the same ones each time: every n-th row could fall on the same pressure step of every state.
    predictions: columns of predictions.csv.
    """
    rows = usable(predictions)
    loads = [name for load in LOADS for name in (load.column, load.predicted)]
    parts = [_thinned(rows[rows["split"] == split]) for split in SPLITS]
    return pd.concat(parts)[[*COLUMNS, *loads]].reset_index(drop=True)


def split_labels(predictions: pd.DataFrame) -> dict[str, str]:
    """A name for each split that has usable rows, which says how many of them are shown where not all are."""
    count = usable(predictions)["split"].value_counts()
    return {
        split: split if count[split] <= SHOWN else f"{split} ({SHOWN} of {count[split]} shown)"
        for split in SPLITS
        if count.get(split, 0)
    }


def parity_ends(shown: pd.DataFrame) -> list[tuple[float, float]]:
    """Ends of the line on which a perfect model would lie, for force and moment. shown: parity_numbers, not empty."""
    both = (shown[[load.column, load.predicted]].to_numpy(dtype=np.float64) for load in LOADS)
    return [(float(np.nanmin(values)), float(np.nanmax(values))) for values in both]


def _thinned(part: pd.DataFrame) -> pd.DataFrame:
    if len(part) <= SHOWN:
        return part
    return part.iloc[np.sort(np.random.default_rng(0).choice(len(part), SHOWN, replace=False))]
