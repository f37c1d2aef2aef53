"""Named sets of samples, and the split of their rows."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from freelearn.common.errors import UserError
from freelearn.data.columns import usable_rows
from freelearn.data.logs import is_log, pieces
from freelearn.data.states import kinematic_state

TRAIN, VALIDATION, TEST = "train", "validation", "test"
# The training set of a run that fits nothing and takes the constituents' parameters.
CONSTITUENT_SET = "constituent"
# The paper's shares: 64 % training, 16 % validation, 20 % test.
SHARES = (0.64, 0.16)


def samples_of(name: str, available: np.ndarray) -> np.ndarray:
    """Samples that a set's name stands for, out of those available. Raises UserError when there are none.

    >>> samples_of("sample1+sample3", np.array([1, 2, 3, 4]))
    array([1, 3])
    """
    present = np.unique(available)
    chosen = np.unique(np.concatenate([_samples_of(part, present) for part in name.split("+")]))
    if not len(chosen):
        raise _no_rows(name, present)
    return chosen


def rows_of_set(table: pd.DataFrame, name: str) -> pd.DataFrame:
    """Rows of the samples in a named set; all rows for the set that names no samples. Raises UserError."""
    if name == CONSTITUENT_SET:
        return table
    sample = table["sample"].to_numpy()
    inside = np.isin(sample, samples_of(name, sample))
    return table if inside.all() else table[inside]


def _samples_of(name: str, present: np.ndarray) -> np.ndarray:
    chosen: np.ndarray
    if name == "all":
        chosen = present
    elif name == "even":
        chosen = present[present % 2 == 0]
    elif match := re.fullmatch(r"sample([0-9]{1,18})", name):
        chosen = present[present == int(match.group(1))]
        if not len(chosen):
            raise _no_rows(name, present)
    elif match := re.fullmatch(r"without([0-9]{1,18})", name):
        chosen = present[present != int(match.group(1))]
    else:
        raise _unknown(name)
    return chosen


def _unknown(name: str) -> UserError:
    return UserError(
        f"Unknown set {name!r}: choose sampleN, withoutN (all samples but N), even, all, several joined by + "
        "(or, for training, constituent)."
    )


def _no_rows(name: str, present: np.ndarray) -> UserError:
    there = ", ".join(f"sample{n}" for n in present)
    return UserError(f"The data hold no rows of set {name!r}: they hold {there}. Choose one of these, or all.")


def set_names(available: np.ndarray) -> list[str]:
    """Every set that the data hold: each sample, and for several samples `even` and `all`."""
    present = np.unique(available)
    names = [f"sample{n}" for n in present]
    if len(present) > 1 and (present % 2 == 0).any():
        names.append("even")
    return [*names, "all"]


def split_rows(table: pd.DataFrame, seed: int, by_states: bool, shares: tuple[float, float] = SHARES) -> np.ndarray:
    """Label of every row, "train", "validation", "test", or "" for a buckled or left-out one: (N,) str.

    Each sample is split on its own, with a generator of its own, so a sample's test rows are the same whatever
    else is in the table or the training set. by_states keeps the rows of one kinematic state together. shares: of
    training and of validation. Of a log whole recordings are held out, or blocks of time where there are few: the
    sample before a held-out one would tell it.
    """
    usable = usable_rows(table)
    sample = table["sample"].to_numpy()
    log = is_log(table)
    by_states = by_states or log
    # Without them every row is one.
    unit = pieces(table) if log else kinematic_state(table) if by_states else np.empty(0)
    # The words themselves, each once: not a copy for every row.
    label = np.full(len(table), "", dtype=object)
    for number in np.unique(sample):
        rows = np.flatnonzero(usable & (sample == number))
        units = np.random.default_rng([seed, int(number)]).permutation(np.unique(unit[rows]) if by_states else rows)
        bounds = np.round(np.cumsum(shares) * len(units)).astype(int)
        for name, part in zip((TRAIN, VALIDATION, TEST), np.split(units, bounds), strict=True):
            label[rows[np.isin(unit[rows], part)] if by_states else part] = name
    return label


def overlap(first: str, second: str) -> bool:
    """Whether two sets share a sample, judged by their names, of a table that has every sample they name."""
    named = [int(n) for n in re.findall(r"[0-9]+", f"{first} {second}")]
    # Of samples that neither names it only matters whether they are even.
    every = np.array([*named, max(named, default=0) + 1, max(named, default=0) + 2])
    return bool(np.isin(samples_of(first, every), samples_of(second, every)).any())
