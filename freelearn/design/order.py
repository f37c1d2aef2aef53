"""In which order a plan's visits are made, as a table."""

from __future__ import annotations

import numpy as np
import pandas as pd

from freelearn.design.candidates import Candidates, digits
from freelearn.measurements.beds import bed_of

# A place that is visited once more lies beside itself by this share of what tells places apart: far less than the bed
# errs, but a table then has no two equal lines.
BESIDE = 0.1


def ordered(there: Candidates, visits: np.ndarray, measured: pd.DataFrame, seed: int) -> pd.DataFrame:
    """The rows of some visits, sample by sample, mountings of each at random: sorted ones would look like a drift.

    measured: rows that there are already."""
    drawn = np.random.default_rng([seed, 307]).permutation(visits)
    parts = sorted((there.rows_of(visit) for visit in drawn), key=lambda part: int(part["sample"].iloc[0]))
    imposed = [quantity.column for quantity in bed_of(there.table).state]
    name = imposed[0]
    low, high = float(there.table[name].min()), float(there.table[name].max())
    step = BESIDE * 10.0 ** -digits(low, high) if high > low else 0.0
    been = set(measured[["sample", *imposed]].itertuples(index=False, name=None))
    out = []
    for part in parts:
        sample, first, second = part[["sample", *imposed]].iloc[0]
        inward = -1.0 if first > (low + high) / 2 else 1.0
        while step and (sample, first, second) in been:
            first = round(first + inward * step, 12)
        been.add((sample, first, second))
        out.append(part.assign(**{name: first}))
    return pd.concat(out, ignore_index=True)
