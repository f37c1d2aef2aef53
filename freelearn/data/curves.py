"""Where a pressure, a length or a twist that was read at the rows of a log goes along a curve between them.

A sine that eight rows follow through a period is off the straight line from row to row by a tenth of its size: a delay,
a lag or friction is asked for there. Where a cubic through the two rows on either side says what a row is far better
than the line through its neighbors, the signal is smooth, and the cubic says what is between rows, too.
"""

from __future__ import annotations

import numpy as np

from freelearn.data.recordings import Recording
from freelearn.data.states import States

# Rows on either side that tell whether a signal is smooth; the share of what lines are off by that cubics may be (of a
# corner in a straight line it is four fifths, of a sine with eight rows a fifth); standard deviations of the noise that
# a row is off its line where it is bent, and the share of rows that are.
AROUND, SMOOTH, BENT, SHARE = 7, 0.3, 3.0, 0.5
# Standard deviations of the noise that a curve has to be off the line, what a line between the samples put there may be
# off by, and pieces of an interval at most. Share of a signal's range that no noise counts as less than: the rows of a
# slow sine need nothing between them, however exact they are.
OFF, LEFT, MOST, LEAST = 1.0, 0.5, 4, 1e-3
# Rows that tell the noise of a long log, about, and how many of them follow each other.
ENOUGH, BLOCK = 20_000, 500
# Rows on one side that a polynomial goes through which tells the noise, at most; share of what fewer say below which
# more are believed; standard deviations in a median absolute deviation.
MOST_BESIDE, CLEARLY, MAD = 4, 0.7, 1.4826


def smooth(signal: np.ndarray, recording: Recording[States], noise: float) -> np.ndarray:
    """Rows (M,) about which a signal goes along a curve: most rows there are bent, and none as at a corner."""
    every, window = np.arange(len(signal)), np.ones(2 * AROUND + 1)
    near = _off(signal, recording, (-1, 1), every)

    def summed(values: np.ndarray) -> np.ndarray:
        total: np.ndarray = np.convolve(values, window)[AROUND:-AROUND]
        return total

    # What is off no line takes no further look.
    many = summed(np.abs(np.nan_to_num(near)) > BENT * noise) > SHARE * summed(np.isfinite(near))
    if not many.any():
        return many
    far = _off(signal, recording, (-2, -1, 1, 2), every)
    both = np.isfinite(near) & np.isfinite(far)
    of_lines, of_cubics = (summed(np.where(both, each, 0.0) ** 2) for each in (near, far))
    found: np.ndarray = many & (of_cubics < SMOOTH**2 * of_lines)
    return found


def pieces(signal: np.ndarray, recording: Recording[States], along: np.ndarray, noise: float) -> np.ndarray:
    """Into how many pieces the interval before each sample is to be cut, (M,): one where the signal goes straight.
    along: rows about which it is smooth."""
    found, noise = np.ones(len(signal), dtype=np.int64), max(noise, LEAST * float(np.ptp(signal)))
    inside = 1 + np.flatnonzero(along[1:] & along[:-1])
    off = between(signal, recording, inside, np.full(len(inside), 0.5)) - (signal[inside] + signal[inside - 1]) / 2
    off = np.abs(np.nan_to_num(off))
    needed = np.ceil(np.sqrt(off / max(LEFT * noise, 1e-300))).clip(1, MOST)
    found[inside] = np.where(off > OFF * noise, needed, 1)
    return found


def between(signal: np.ndarray, recording: Recording[States], rows: np.ndarray, share: np.ndarray) -> np.ndarray:
    """A signal where this share (n,) of the interval before each of some rows (n,) is over, by a cubic through two rows
    on either side, (n,): NaN where these are not all of one recording."""
    time = recording.time.numpy()
    return _through(signal, recording, (-2, -1, 0, 1), rows, (1 - share) * time[rows - 1] + share * time[rows])


def flicker(signal: np.ndarray, recording: Recording[States]) -> float:
    """Standard deviation of a signal's noise by what rows are off polynomials through their neighbors, in which curves
    leave hardly anything, the more of these the less. Infinite where no recording has five rows."""
    time, found = recording.time.numpy(), float("inf")
    if not np.ptp(signal):
        return 0.0
    rows = np.arange(len(signal))
    if len(rows) > ENOUGH:
        first = np.linspace(0, len(rows) - BLOCK, ENOUGH // BLOCK).astype(np.int64)
        rows = (first[:, None] + np.arange(BLOCK)).reshape(-1)
    for beside in range(2, MOST_BESIDE + 1):
        places = tuple(k for k in range(-beside, beside + 1) if k)
        off = _off(signal, recording, places, rows)
        off /= np.sqrt(1 + np.square(_weights(time, places, rows, time[rows])).sum(axis=0))
        said = float(np.nanmedian(np.abs(off))) * MAD if np.isfinite(off).any() else np.inf
        # Of several that say the same the least is that of chance.
        found = said if said < CLEARLY * found else found
    return found


def _off(signal: np.ndarray, recording: Recording[States], places: tuple[int, ...], rows: np.ndarray) -> np.ndarray:
    """By how much some rows (n,) are off the polynomial through those so many places from each, (n,)."""
    asked = recording.time.numpy()[rows]
    found: np.ndarray = signal[rows] - _through(signal, recording, places, rows, asked)
    return found


def _through(
    signal: np.ndarray, recording: Recording[States], places: tuple[int, ...], rows: np.ndarray, asked: np.ndarray
) -> np.ndarray:
    """The polynomial through the rows so many places from each of some (n,), at a time that is asked for, (n,)."""
    run, time, last = recording.run.numpy(), recording.time.numpy(), len(signal) - 1
    first, end = rows + min(places), rows + max(places)
    # Runs stand one after the other.
    inside = (first >= 0) & (end <= last) & (run[first.clip(0)] == run[end.clip(0, last)])
    found = np.full(len(rows), np.nan)
    rows, asked = rows[inside], asked[inside]
    weights = _weights(time, places, rows, asked)
    found[inside] = sum(weight * signal[rows + k] for k, weight in zip(places, weights, strict=True))
    return found


def _weights(time: np.ndarray, places: tuple[int, ...], rows: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Of the rows so many places from each of some (n,), in the polynomial through them at a time that is asked for:
    Lagrange's form, (places, n)."""
    times = [time[(rows + k).clip(0, len(time) - 1)] for k in places]
    found = np.ones((len(places), len(rows)))
    with np.errstate(divide="ignore", invalid="ignore"):
        for k, own in enumerate(times):
            for j, other in enumerate(times):
                if j != k:
                    found[k] *= (asked - other) / (own - other)
    return found
