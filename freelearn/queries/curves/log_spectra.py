"""What a model leaves of a log by its frequency, beside the noise that was stated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from scipy.signal import welch

from freelearn.data.accuracy import Accuracy
from freelearn.data.beds import Quantity
from freelearn.data.logs import TIME, run_numbers
from freelearn.data.states import States
from freelearn.discovery.noise.noise import own_variances
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.prediction import usable
from freelearn.queries.curves.curve_rows import measured_quantities, misses

# Samples of a stretch that is transformed: a quarter of a usual recording, within these.
SHORTEST, LONGEST, SHARE = 16, 2048, 4
# A pause of more than so many usual steps parts a recording.
PAUSE = 5
ABOUT_SPECTRA = (
    "Spectra: of all recordings, without their means (Welch). What rises above the noise has a cause that lasts."
)
HERTZ, STATED, LEFT = "frequency [Hz]", "noise, as stated or estimated", "measured − predicted"
# Rows at which the stated noise is worked out.
LOOKED_AT = 1000


@dataclass(frozen=True)
class Spectrum:
    """Of one quantity: the one-sided power density of measured − predicted, `density` (n,) unit²/Hz at `frequency` (n,)
    Hz, of recordings in pieces whose means are taken off; noise: that of the stated noise of each row, if it has no
    memory; None where no accuracy is known."""

    quantity: Quantity
    frequency: np.ndarray
    density: np.ndarray
    noise: float | None

    @property
    def unit(self) -> str:
        """Of the density."""
        return f"({self.quantity.unit})²/Hz" if "·" in self.quantity.unit else f"{self.quantity.unit}²/Hz"


def log_spectra(model: Model, table: pd.DataFrame, accuracy: Accuracy | None) -> list[Spectrum]:
    """A spectrum of each quantity that a log measures, averaged over its recordings (Welch 1967).

    table: in the columns of predictions.csv. Where the samples are uneven they are first read off at even steps, the
    usual one. Quantities of which no recording has rows enough are left out."""
    rows = usable(table)
    if not len(rows):
        return []
    left, run, time = misses(rows), run_numbers(rows), rows[TIME].to_numpy(dtype=np.float64)
    found = []
    for quantity in measured_quantities(rows):
        value = left[quantity.column].to_numpy(dtype=np.float64)
        there = np.isfinite(value)
        pieces, step = _pieces(time[there], value[there], run[there])
        if not pieces:
            continue
        frequency, density = _density(pieces, step)
        noise = None
        if accuracy is not None:
            # White noise of a variance spreads evenly up to half the rate.
            noise = 2 * step * _stated(model, rows.iloc[np.flatnonzero(there)], accuracy, quantity)
        found.append(Spectrum(quantity, frequency, density, noise))
    return found


def _pieces(time: np.ndarray, value: np.ndarray, run: np.ndarray) -> tuple[list[np.ndarray], float]:
    """Stretches of recordings without a pause, at even steps, and the step [s]."""
    same = np.diff(run) == 0
    if not same.any():
        return [], 0.0
    steps = np.diff(time)
    step = float(np.median(steps[same]))
    cuts = np.flatnonzero(~same | (steps > PAUSE * step)) + 1
    pieces = []
    for rows in np.split(np.arange(len(time)), cuts):
        if len(rows) < SHORTEST:
            continue
        own = time[rows]
        even = own[0] + step * np.arange(round(float(own[-1] - own[0]) / step) + 1)
        uneven = len(even) != len(own) or np.abs(even - own).max() > 0.1 * step
        pieces.append(np.interp(even, own, value[rows]) if uneven else value[rows])
    return pieces, step


def _density(pieces: list[np.ndarray], step: float) -> tuple[np.ndarray, np.ndarray]:
    """Of pieces long enough for as long a transform as a usual one has room for, each weighing as many samples."""
    usual = int(np.median([len(piece) for piece in pieces])) // SHARE
    length = int(np.clip(usual, SHORTEST, LONGEST))
    weights, densities = [], []
    for piece in pieces:
        if len(piece) >= length:
            frequency, density = welch(piece, fs=1 / step, nperseg=length)
            weights.append(len(piece))
            densities.append(density)
    # Of the mean, which was taken off, nothing is told.
    return frequency[1:], np.average(densities, axis=0, weights=weights)[1:]


def _stated(model: Model, rows: pd.DataFrame, accuracy: Accuracy, quantity: Quantity) -> float:
    """The variance that the stated accuracy gives a row's own reading, in the unit of its column, squared."""
    some = rows.iloc[np.unique(np.linspace(0, len(rows) - 1, LOOKED_AT).astype(int))].reset_index(drop=True)
    # How the pressure's noise comes in is a matter of the moment.
    states = States.from_table(some).replace(recording=None, place=None)
    channel = states.bed.readings.index(quantity)
    own = own_variances(model, states, accuracy)[:, channel]
    return float(torch.mean(own)) / quantity.factor**2


def spectrum_table(spectra: Sequence[Spectrum]) -> pd.DataFrame:
    """One row for each frequency of each quantity: quantity, frequency_hz, density, noise, unit."""
    parts = [
        pd.DataFrame(
            {
                "quantity": shown.quantity.name, "frequency_hz": shown.frequency, "density": shown.density,
                "noise": np.nan if shown.noise is None else shown.noise, "unit": shown.unit,
            }
        )
        for shown in spectra
    ]  # fmt: skip
    return pd.concat(parts, ignore_index=True)
