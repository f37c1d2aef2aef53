"""Slips of the hand and of the sensor: readings that are not what the load cell saw, put where they are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

Array = np.ndarray[Any, Any]
LOADS = ("force_n", "moment_nmm")
# What a wrong unit multiplies a reading by: a force read in pounds, a moment in micronewton-meters.
UNIT_FACTOR = {"force_n": 0.2248, "moment_nmm": 1000.0}


def _other_row(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    same = np.flatnonzero((table["sample"] == table["sample"].iloc[row]) & (table["buckled"] == 0))
    return float(table[load].iloc[int(generator.choice(same[same != row]))])


def _sign(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    return -float(table[load].iloc[row])


def _decimal(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    return float(table[load].iloc[row] * generator.choice([10.0, 0.1]))


def _unit(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    return float(table[load].iloc[row] * UNIT_FACTOR[load])


def _stuck(table: pd.DataFrame, row: int, load: str, generator: np.random.Generator) -> float:
    return float(table[load].iloc[max(row - 1, 0)])


# Kind → the reading that stands in the row: (table of true readings, row, load, generator).
KINDS: dict[str, Callable[[pd.DataFrame, int, str, np.random.Generator], float]] = {
    "other_row": _other_row,
    "sign": _sign,
    "decimal": _decimal,
    "unit": _unit,
    "stuck": _stuck,
}


def slip(
    table: pd.DataFrame, share: float, kinds: Sequence[str], deviation: Mapping[str, Array], seed: Sequence[int]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The table with one reading wrong in a share of its rows, at least in one, and the truth about them.

    deviation: standard deviation of each load's sensor at every row, in the table's units. Buckled rows have no
    readings that count, and so no slips. The truth: row (position in the table), load, kind, displacement (in the
    table's unit) and sensor_sigmas, the displacement's size in the sensor's own standard deviations.
    """
    truth = pd.DataFrame(columns=["row", "load", "kind", "displacement", "sensor_sigmas"])
    places = np.flatnonzero(table["buckled"] == 0)
    if share <= 0 or len(places) < 2:
        return table, truth.astype({"row": int, "displacement": float, "sensor_sigmas": float})
    generator = np.random.default_rng(seed)
    count = min(max(1, round(share * len(places))), len(places))
    slipped, found = table.copy(), []
    for row in sorted(generator.choice(places, count, replace=False).tolist()):
        load, kind = str(generator.choice(LOADS)), str(generator.choice(list(kinds)))
        reading = KINDS[kind](table, row, load, generator)
        change = reading - float(table[load].iloc[row])
        slipped.loc[slipped.index[row], load] = reading
        # A silent sensor has no deviation to measure the slip by.
        sigma = float(deviation[load][row])
        sigmas = abs(change) / sigma if sigma > 0 else np.inf
        found.append({"row": row, "load": load, "kind": kind, "displacement": change, "sensor_sigmas": sigmas})
    return slipped, pd.DataFrame(found)
