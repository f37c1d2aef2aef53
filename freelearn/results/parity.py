"""Predicted against measured quantities, as numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from freelearn.measurements.beds import Quantity, bed_of
from freelearn.measurements.sets import TEST, TRAIN, VALIDATION
from freelearn.measurements.usable import SLACK
from freelearn.models.predicted import usable
from freelearn.results.quantities import pressures, told

SPLITS = (TRAIN, VALIDATION, TEST)
# More points than this per split only darken the picture.
SHOWN = 3000


def parity_numbers(predictions: pd.DataFrame) -> pd.DataFrame:
    """The rows shown: usable ones, at most SHOWN of each split, with their places, what was measured and what is
    predicted; `slack` where the table has it.

    Drawn at random, the same ones each time: every n-th row could fall on the same pressure step of every state.
    predictions: columns of predictions.csv.
    """
    rows = usable(predictions)
    imposed = [q.column for q in (*bed_of(predictions).state, *pressures(predictions))]
    both = [name for q in told(predictions) for name in (q.column, q.predicted)]
    marks = [SLACK] if SLACK in predictions else []
    shown = [_thinned(np.flatnonzero(rows["split"] == split)) for split in SPLITS]
    columns = ["sample", *imposed, "split", *both, *marks]
    return rows[columns].iloc[np.concatenate(shown)].reset_index(drop=True)


def split_labels(predictions: pd.DataFrame) -> dict[str, str]:
    """A name for each split that has usable rows, which says how many of them are shown where not all are."""
    count = usable(predictions)["split"].value_counts()
    return {
        split: split if count[split] <= SHOWN else f"{split} ({SHOWN} of {count[split]} shown)"
        for split in SPLITS
        if count.get(split, 0)
    }


def loose_rows(shown: pd.DataFrame) -> np.ndarray:
    """Which rows of parity_numbers are of a tube that hangs loose, (n,) bool."""
    loose: np.ndarray = shown[SLACK].to_numpy() == 1 if SLACK in shown else np.zeros(len(shown), dtype=bool)
    return loose


def parity_ends(shown: pd.DataFrame, quantities: Sequence[Quantity]) -> list[tuple[float, float]]:
    """Ends of the line on which a perfect model would lie, for each quantity. shown: parity_numbers, not empty."""
    both = (shown[[q.column, q.predicted]].to_numpy(dtype=np.float64) for q in quantities)
    return [(float(np.nanmin(values)), float(np.nanmax(values))) for values in both]


def _thinned(part: np.ndarray) -> np.ndarray:
    if len(part) <= SHOWN:
        return part
    thinned: np.ndarray = part[np.sort(np.random.default_rng(0).choice(len(part), SHOWN, replace=False))]
    return thinned
