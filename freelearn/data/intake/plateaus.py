"""Plateaus of a log: where a bed stood still, and what it read there on average."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import sliding_window_view

from freelearn.common.errors import UserError
from freelearn.data.beds import BEDS
from freelearn.data.intake.evaluate import FILE, LINE
from freelearn.data.intake.recipes.recipe import Plateaus, Recipe

COUNT = "n_readings"


def find_plateaus(columns: Mapping[str, np.ndarray], tolerances: Mapping[str, float], least: int) -> np.ndarray:
    """The plateau that each reading belongs to, (N,) int64 from 0 up; −1 where the bed was under way.

    A window of `least` readings is steady where no column wanders farther in it than its tolerance; steady windows that
    share readings are one plateau.

    >>> find_plateaus({"p": np.array([0.0, 0, 0, 4, 8, 8, 8])}, {"p": 1.0}, 3).tolist()
    [0, 0, 0, -1, 1, 1, 1]
    """
    count = len(next(iter(columns.values())))
    if count < least:
        return np.full(count, -1, dtype=np.int64)
    steady = np.ones(count - least + 1, dtype=bool)
    for name, tolerance in tolerances.items():
        windows = sliding_window_view(columns[name], least)
        steady &= windows.max(axis=1) - windows.min(axis=1) <= tolerance
    places, number, end = np.full(count, -1, dtype=np.int64), -1, 0
    for start in np.flatnonzero(steady):
        if number < 0 or start >= end:
            number += 1
        places[start : start + least] = number
        end = int(start) + least
    return places


def averaged(
    table: pd.DataFrame, plateaus: Plateaus, measured: Sequence[str], kept: Sequence[str]
) -> tuple[pd.DataFrame, int]:
    """A row for each plateau: means, the first value of the columns `kept`, the number of readings and, of the measured
    columns, the standard error of the mean; and how many readings belong to none.

    table: a log's rows in their order, one file and sample. The standard error takes readings to err independently.
    """
    columns = {name: table[name].to_numpy(dtype=np.float64) for name in plateaus.of}
    places = find_plateaus(columns, plateaus.of, plateaus.least + plateaus.settle)
    rows = []
    for number in range(places.max() + 1):
        part = table[places == number].iloc[plateaus.settle :]
        row: dict[str, object] = {name: part[name].iloc[0] for name in kept}
        numbers = part.drop(columns=list(kept))
        row |= numbers.mean().to_dict()
        row[COUNT] = len(part)
        for name in measured:
            good = numbers[name].dropna()
            row[error_column(name)] = good.std(ddof=1) / np.sqrt(len(good)) if len(good) > 1 else np.nan
        rows.append(row)
    names = [*table.columns, COUNT, *map(error_column, measured)]
    return pd.DataFrame(rows, columns=names), int(len(table) - sum(int(row[COUNT]) for row in rows))  # type: ignore[call-overload]


def error_column(name: str) -> str:
    """The column with the standard error of another's mean.

    >>> error_column("force_n")
    'force_se_n'
    """
    stem, _, unit = name.rpartition("_")
    return f"{stem}_se_{unit}"


def over_plateaus(recipe: Recipe, table: pd.DataFrame) -> tuple[pd.DataFrame, int]:
    """The table with its readings averaged, where the recipe asks for it, and how many belong to no plateau."""
    if recipe.plateaus is None:
        return table, 0
    unknown = [name for name in recipe.plateaus.of if name not in table]
    if unknown:
        raise UserError(f"plateaus.of names {unknown[0]}, which the recipe does not make: name one of its columns.")
    measured = [q.column for q in BEDS[recipe.bed].measured if q.column in table]
    words = [name for name in table if not pd.api.types.is_numeric_dtype(table[name])]
    kept = list(dict.fromkeys([*words, "sample", FILE, LINE, *recipe.marks]))
    done = [averaged(part, recipe.plateaus, measured, kept) for _, part in table.groupby("sample", sort=False)]
    result = pd.concat([part for part, _ in done], ignore_index=True)
    if not len(result):
        raise UserError(
            f"{table[FILE].iloc[0]}: no plateau of {recipe.plateaus.least} readings: allow more in plateaus.of, or "
            "fewer readings in least."
        )
    return result, sum(left for _, left in done)
