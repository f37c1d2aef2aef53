"""How good one run is, in a few numbers: what a table of many runs is sorted by."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from freelearn.measurements.sets import CONSTITUENT_SET, overlap
from freelearn.results.run import Run


class Scores(NamedTuple):
    """Errors E, as fractions; None where nothing was tested. own: on the training set's own test rows; unseen: mean
    over test sets of samples never trained on; mean, median: over all test sets."""

    own: float | None
    unseen: float | None
    mean: float | None
    median: float | None


def scores(run: Run) -> Scores:
    """Of a run's test sets those with a finite error."""
    errors = {name: error.E for name, error in run.errors.items() if np.isfinite(error.E)}
    fitted = run.train != CONSTITUENT_SET
    unseen = [value for name, value in errors.items() if fitted and not overlap(run.train, name)]
    every = list(errors.values())
    return Scores(
        errors.get(run.train) if fitted else None,
        float(np.mean(unseen)) if unseen else None,
        float(np.mean(every)) if every else None,
        float(np.median(every)) if every else None,
    )
