"""Blocks of rows whose readings have another scale than the rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

# Sizes on the two sides of a gap differ at least so much.
GAP = 3.0
# So much do the medians differ: of the readings themselves, and of the middle of so many neighbors, which is needed
# where readings pass through zero, and which states at rest make small, too.
RATIO, NEIGHBORS_RATIO, NEIGHBORS = 5.0, 20.0, 9
# Shorter blocks are slips of single readings, and more of them are no blocks.
LEAST_ROWS, MOST_BLOCKS = 5, 3


def scale_jumps(table: pd.DataFrame, columns: Sequence[str]) -> Iterator[str]:
    """A sentence for each column whose readings come in two sizes, a long block each.

    >>> rows = pd.DataFrame({"force_n": [1.0, 1.2, 1.1, 0.9, 1.3, 1100, 1200, 1000, 900, 1300]})
    >>> next(scale_jumps(rows, ["force_n"]))
    'force_n from row 6 to 10 is about 1000 times as large as elsewhere: one unit or amplifier range for all rows?'
    """
    for column in columns:
        values = np.abs(table[column].to_numpy(dtype=np.float64))
        places = np.flatnonzero(values > 0)
        if len(places) < 2 * LEAST_ROWS:
            continue
        sizes = values[places]
        middle = pd.Series(sizes).rolling(NEIGHBORS, center=True, min_periods=1).median().to_numpy()
        large = _large(np.log(sizes), RATIO)
        if large is None:
            large = _large(np.log(middle), NEIGHBORS_RATIO)
        if large is None:
            continue
        runs = np.split(np.arange(len(places)), np.flatnonzero(np.diff(large.astype(int))) + 1)
        ratio = np.median(values[places[large]]) / np.median(values[places[~large]])
        few_large = large.sum() <= (~large).sum()
        block = next(run for run in runs if large[run[0]] == few_large)
        size = f"{_rounded(ratio)} times as large as" if few_large else f"1/{_rounded(ratio)} of"
        yield (
            f"{column} from row {places[block[0]] + 1} to {places[block[-1]] + 1} is about {size} elsewhere: one unit "
            "or amplifier range for all rows?"
        )


def _large(sizes: np.ndarray, ratio: float) -> np.ndarray | None:
    """Which of log sizes lie above the widest gap among them, (N,) bool; None where there is no clear gap, or where the
    two sides are no long blocks."""
    ordered = np.sort(sizes)
    gaps = np.diff(ordered)
    place = int(gaps.argmax())
    if gaps[place] <= np.log(GAP):
        return None
    above = sizes > ordered[place]
    if np.median(sizes[above]) - np.median(sizes[~above]) <= np.log(ratio):
        return None
    lengths = np.diff([0, *(np.flatnonzero(np.diff(above.astype(int))) + 1), len(above)])
    return None if len(lengths) > MOST_BLOCKS or lengths.min() < LEAST_ROWS else above


def _rounded(ratio: float) -> str:
    return f"{float(f'{ratio:.2g}'):g}"
