"""The error falling from step to step towards the noise floor: numbers, table and the axis of both pictures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from freelearn.results.formats import fixed, percent
from freelearn.results.tables import DisplayTable


class Staircase(NamedTuple):
    """E, floor: (steps,) in %, the floor NaN where it is not known. labels: E in words. low, high: ends of a
    logarithmic axis. On a linear one the last steps, which decide, would not show."""

    steps: list[str]
    E: np.ndarray
    floor: np.ndarray
    labels: list[str]
    low: float
    high: float


def staircase(trail: pd.DataFrame) -> Staircase:
    """What both pictures draw. trail: step, E_heldout, noise_floor (fractions), see discovery.trail_numbers."""
    error, floor = (100 * trail[name].to_numpy(dtype=np.float64) for name in ("E_heldout", "noise_floor"))
    low = float(np.nanmin(np.r_[error, floor]))
    labels = [f"{value:.3g} %" for value in error]
    return Staircase(list(trail["step"]), error, floor, labels, low / 1.5, float(np.nanmax(error)) * 1.9)


def staircase_row(step: str, fitted: float, heldout: float, floor: float, sigmas: float) -> list[str]:
    """The cells of one step; errors as fractions."""
    return [step, *(percent(value, 3) for value in (fitted, heldout, floor)), fixed(sigmas, 2)]


HEADINGS = ("E fitted %", "E held-out %", "noise floor %", "held-out σ")


def staircase_table(trail: pd.DataFrame) -> DisplayTable:
    """trail: see discovery.trail_numbers."""
    columns = [trail[name].tolist() for name in ("step", "E_train", "E_heldout", "noise_floor", "sigmas_heldout")]
    rows = [staircase_row(*cells) for cells in zip(*columns, strict=True)]
    return DisplayTable.of(["step"], HEADINGS, rows, title="The error, step by step")
