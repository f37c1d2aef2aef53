"""The 95 % bands beside a model's curves: their ends as numbers, and the areas that pictures fill."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.answer.bands import Bands
from freelearn.measurements.states import States

# What the bands are called in legends with room, and in narrow ones.
BAND, SHORT = "95 % band for a new measurement", "95 % band"


def ends(column: str) -> tuple[str, str]:
    """The columns of the lower and of the upper end of a quantity's band.

    >>> ends("force_pred_n")
    ('force_pred_n_low', 'force_pred_n_high')
    """
    return f"{column}_low", f"{column}_high"


def band_ends(bands: Bands, path: States, shown: Tensor, within: np.ndarray) -> dict[str, np.ndarray]:
    """Both ends of the band of each quantity that the bed measures, (N,) each in the table's units, by their columns;
    NaN where nothing tells them.

    shown: (N, 2) SI, what the model says at each point of a path; within: (N,) bool, the points whose pressures were
    measured. How far a model misses is told by rows like those that it was compared with: neither beyond the measured
    pressures nor of an actuator of which no row was compared does anything tell it."""
    half = np.full(shown.shape, np.nan)
    told = torch.isin(path.sample, bands.miss.held.system.states.sample.unique()).numpy()
    rows = np.flatnonzero(within & told & shown.isfinite().all(-1).numpy())
    if len(rows):
        place = torch.as_tensor(rows)
        half[rows] = bands.half(path[place], shown[place])
    columns: dict[str, np.ndarray] = {}
    for i, quantity in enumerate(path.bed.readings):
        if quantity in path.bed.measured:
            pair = shown[:, i].numpy() - half[:, i], shown[:, i].numpy() + half[:, i]
            columns |= {name: end / quantity.factor for name, end in zip(ends(quantity.predicted), pair, strict=True)}
    return columns


def has_band(curve: pd.DataFrame, column: str) -> bool:
    """Whether a curve's frame says of any point how far a new measurement of this quantity may lie."""
    low, _ = ends(column)
    return low in curve and bool(curve[low].notna().any())


def strip(curve: pd.DataFrame, across: str, up: str) -> np.ndarray:
    """What a picture fills to show a band: x, one end and the other, (M, 3), to be run along by the one end and back by
    the other; blanks are bridged without any width.

    The pressure rises and falls, so a band lies on itself. Where the pressure falls the ends are exchanged: so the area
    is always run around in the same sense, and a canvas fills it evenly, however often it lies on itself. curve: a
    frame of curve.model_curve; across, up: its columns."""
    if not has_band(curve, up):
        return np.empty((0, 3))
    x, low, high = (curve[name].to_numpy(dtype=np.float64) for name in (across, *ends(up)))
    there = np.isfinite(x + low + high)
    first = np.flatnonzero(there[:-1] & there[1:])
    # Of each step from point to point its beginning and its end, twice: without width, and as wide as the band.
    points = first[:, None] + [0, 0, 1, 1]
    narrow, falls = np.array([True, False, False, True]), (x[first + 1] < x[first])[:, None]
    middle = ((low + high) / 2)[points]
    one = np.where(narrow, middle, np.where(falls, high[points], low[points]))
    other = np.where(narrow, middle, np.where(falls, low[points], high[points]))
    return np.stack([x[points], one, other], axis=-1).reshape(-1, 3)
