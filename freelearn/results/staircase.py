"""The error falling from step to step towards the noise floor: numbers, table and the axis of both pictures."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pandas as pd

from freelearn.results.formats import RUN_AWAY, error_percent, fixed, known_floor
from freelearn.results.tables import DisplayTable

# Share of the axis that is left free below the lowest and above the highest.
ROOM = 0.15
# An axis up to so many times as high as low has numbers closer to each other.
DECADE = 12.0
# The axis where nothing is known [%].
EMPTY = (1.0, 10.0)


class Staircase(NamedTuple):
    """E, floor: (steps,) in %, NaN where they are not known. labels: E in words, "" where it is not known; under:
    (steps,), whether E is below the floor, and its label with it. low, high: ends of a logarithmic axis. On a linear
    one the last steps, which decide, would not show."""

    steps: list[str]
    E: np.ndarray
    floor: np.ndarray
    labels: list[str]
    under: np.ndarray
    low: float
    high: float

    @property
    def ticks(self) -> list[float]:
        """Numbers for the axis: 1, 2 and 5, and more where it spans less than a decade or so."""
        steps = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if self.high < DECADE * self.low else (1.0, 2.0, 5.0)
        powers = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        return [tick for power in powers for step in steps if self.low <= (tick := step * 10.0**power) <= self.high]


def staircase(trail: pd.DataFrame) -> Staircase:
    """What both pictures draw. trail: step, E_heldout, noise_floor (fractions), see discovery.trail_numbers."""
    error, floor = (100 * trail[name].to_numpy(dtype=np.float64) for name in ("E_heldout", "noise_floor"))
    floor = np.where(floor < 100, floor, np.nan)
    away = error > 100 * RUN_AWAY
    error = np.where(away & np.isfinite(error), 100 * RUN_AWAY, error)
    # A model without an answer at a held-out state has no error that an axis could show, and zero has no logarithm.
    both = np.r_[error, floor]
    known = both[np.isfinite(both) & (both > 0)]
    low, high = (float(known.min()), float(known.max())) if len(known) else EMPTY
    error, floor = (np.where(np.isfinite(values) & (values > 0), values, np.nan) for values in (error, floor))
    labels = [
        "" if np.isnan(value) else f"> {value:.0f} %" if beyond else f"{value:.3g} %"
        for value, beyond in zip(error, away, strict=True)
    ]
    # So many times as much at either end that a label has its room, however far the error falls.
    room = max(1.6, (high / low) ** ROOM)
    return Staircase(list(trail["step"]), error, floor, labels, error < floor, low / room, high * room)


def staircase_row(step: str, fitted: float, heldout: float, floor: float, sigmas: float) -> list[str]:
    """The cells of one step; errors as fractions."""
    return [step, *(error_percent(value, 3) for value in (fitted, heldout, known_floor(floor))), fixed(sigmas, 2)]


HEADINGS = ("E fitted %", "E held-out %", "noise floor %", "misfit in noise standard deviations")


def staircase_table(trail: pd.DataFrame) -> DisplayTable:
    """trail: see discovery.trail_numbers."""
    columns = [trail[name].tolist() for name in ("step", "E_train", "E_heldout", "noise_floor", "sigmas_heldout")]
    rows = [staircase_row(*cells) for cells in zip(*columns, strict=True)]
    return DisplayTable.of(["step"], HEADINGS, rows, title="The error, step by step")
