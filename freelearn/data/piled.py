"""Readings that pile up at the end of what their instrument reads."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

# A reading that stands at the extreme so often did not get there by chance: so many times, this share of all, and so
# many times as often as others do.
FEWEST, SHARE, TIMES = 5, 0.01, 5
# A channel with fewer different values is one of settings or switches, not of readings.
LEAST_VALUES = 20


def piled(values: np.ndarray) -> Iterator[tuple[float, int]]:
    """The smallest and the largest of readings (n,), NaN where there is none, if these pile up there; and how many do.

    Zero is a true reading of many channels: a vented gauge, a slack tube.

    >>> list(piled(np.r_[np.linspace(-1, 2, 60), np.full(9, 2.0)]))
    [(2.0, 10)]
    """
    levels, counts = np.unique(values[~np.isnan(values)], return_counts=True)
    if len(levels) < LEAST_VALUES:
        return
    least = max(FEWEST, SHARE * counts.sum(), TIMES * float(np.median(counts)))
    for place in (0, -1):
        if counts[place] >= least and levels[place] != 0:
            yield float(levels[place]), int(counts[place])
