"""What a signal along a measured log was without the noise of what the bed imposed.

An element that sticks until a load has changed by its threshold follows every flicker of a gauge: friction as small as
the noise takes it off the loads and fits them better, and a threshold that is there seems smaller, since the largest
reading before a turn is the one that the noise has raised. A lag of half a row and a delay that makes up for it are a
mean of several readings, and fit better too. Where all that is imposed went straight through some rows, a line through
these says what a row was, with less noise (local linear smoothing: Cleveland, J. Am. Stat. Assoc. 74, 829, 1979).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial

import numpy as np
import torch
from torch import Tensor

# Rows beside the one that is asked for, on both sides together, that a line goes through, at most.
WIDEST = 6
# Standard deviations of χ² by which rows may scatter about a line that they are on.
ABOUT = 2.0
# How far off one of them may be, in standard deviations of the noise.
FAR = 3.5
# Windows that are looked at together.
TOGETHER = 1 << 16
# Share of a signal's range below which nothing is noise.
SMALLEST = 1e-12

# So many rows before and behind, those first whose line says most of the row between; at the end of a line, and next to
# it, those on one side.
WINDOWS = ((3, 3), (1, 5), (5, 1), (2, 2), (0, 6), (6, 0), (1, 1), (0, 4), (4, 0), (0, 2), (2, 0))

Lines = tuple[Tensor, Tensor]


class Calm:
    """Which samples make up the line at each of M, with what weights: made when it is first asked for."""

    def __init__(self, make: Callable[[], Lines]) -> None:
        """make: places and weights of the samples that make up each one's value, (M, WIDEST + 1) each."""
        self._make = make

    @classmethod
    def of_inputs(cls, time: np.ndarray, piece: np.ndarray, inputs: np.ndarray, noises: Sequence[float]) -> Calm:
        """time: (M,) s. piece: number of the recording, or of the part of one, in which a line has to stay, (M,).
        inputs: what was imposed, (M, i), with the standard deviations of its noise."""
        return cls(partial(_lines, time, piece, inputs, noises))

    def __getitem__(self, rows: Tensor) -> Calm:
        """The same of some samples, by their numbers in order."""
        return Calm(partial(_some, self, rows))

    @cached_property
    def lines(self) -> Lines:
        """Places and weights, (M, WIDEST + 1) each."""
        return self._make()

    @cached_property
    def within(self) -> Tensor:
        """Samples on a line with those before and behind them, (M,) bool."""
        places, _ = self.lines
        here = torch.arange(len(places), device=places.device)
        return (places.amin(1) < here) & (places.amax(1) > here)

    @cached_property
    def straight(self) -> bool:
        """Whether there is any such sample."""
        return bool(self.within.any())

    def of(self, signal: Tensor) -> Tensor:
        """A signal along the samples (M, c), every one on its line."""
        places, weights = self.lines
        moved = (weights[:, 0] != 1).nonzero()[:, 0]
        if not len(moved):
            return signal
        moved, places, weights = (each.to(signal.device) for each in (moved, places[moved], weights[moved]))
        # One after the other: of many derivatives at once all would be as much memory as the log several times.
        line = torch.zeros_like(signal[moved])
        for at, weight in zip(places.unbind(1), weights.unbind(1), strict=True):
            line = line + signal[at] * weight[:, None]
        return signal.index_copy(0, moved, line)


def _some(calm: Calm, rows: Tensor) -> Lines:
    """Of some samples: those whose line needs others stay as they are."""
    places, weights = (each.to(rows.device)[rows] for each in calm.lines)
    now = torch.searchsorted(rows, places).clamp_max(len(rows) - 1)
    whole = ((rows[now] == places) | (weights == 0)).all(1, keepdim=True)
    alone = torch.zeros_like(weights)
    alone[:, 0] = 1.0
    here = torch.arange(len(rows), device=rows.device)[:, None]
    return torch.where(whole, now, here), torch.where(whole, weights, alone)


def _lines(time: np.ndarray, piece: np.ndarray, inputs: np.ndarray, noises: Sequence[float]) -> Lines:
    """As Calm.of_inputs."""
    count = len(time)
    sizes = np.maximum(np.maximum(noises, SMALLEST * np.abs(inputs).max(0, initial=0.0)), 1e-300)
    values = inputs / sizes
    places = np.repeat(np.arange(count)[:, None], WIDEST + 1, axis=1)
    weights = np.zeros((count, WIDEST + 1))
    weights[:, 0] = 1.0
    bent = _bends(time, piece, values)
    bends = np.cumsum(bent)
    # On a curve, all of which are, no line is looked for.
    straight = np.pad(~bent, 1)
    left = np.flatnonzero(straight[:-2] | straight[1:-1] | straight[2:])
    for before, behind in WINDOWS:
        inside = left[(left >= before) & (left < count - behind)]
        first, last = inside - before, inside + behind
        inside = inside[(piece[first] == piece[last]) & (bends[first] == bends[last - 1])]
        taken = np.zeros(count, dtype=bool)
        for some in np.array_split(inside, len(inside) // TOGETHER + 1):
            around = some[:, None] + np.arange(-before, behind + 1)
            lies, weight = _straight(values[around], time[around] - time[some][:, None])
            found = some[lies]
            places[found, : around.shape[1]] = around[lies]
            weights[found, : around.shape[1]] = weight[lies]
            taken[found] = True
        left = left[~taken[left]]
    return torch.as_tensor(places), torch.as_tensor(weights)


def _allowed(number: int) -> float:
    """Squares that so many samples may be off their line by together, in variances of the noise."""
    free = number - 2
    return free + ABOUT * float(np.sqrt(2.0 * free))


def _bends(time: np.ndarray, piece: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Samples (M,) that are on no line with those before and behind them, whatever others are on it: what the three are
    off by together is at least as much as their second difference says."""
    found = np.zeros(len(time), dtype=bool)
    if len(time) > 2:
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.diff(values, axis=0) / np.diff(time)[:, None]
            step = 1 / np.diff(time)
            size = np.sqrt(step[:-1] ** 2 + step[1:] ** 2 + (step[:-1] + step[1:]) ** 2)
            off = np.abs(np.diff(slope, axis=0)).max(1, initial=0.0) / size
        found[1:-1] = (off > _allowed(WIDEST + 1) ** 0.5) & (piece[:-2] == piece[2:])
    return found


def _straight(values: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of windows of samples (n, k), so long after the one asked for: whether all that is imposed, (n, k, i) in standard
    deviations of its noise, is straight there, (n,), and the weights of a line's value at that one, (n, k)."""
    number = values.shape[1]
    off = after - after.mean(1, keepdims=True)
    square = (off**2).sum(1, keepdims=True)
    weight = 1 / number - after.mean(1, keepdims=True) * off / square
    level = values - values.mean(1, keepdims=True)
    missed = level - ((level * off[..., None]).sum(1) / square)[:, None] * off[..., None]
    near = (missed**2).sum(1) <= _allowed(number)
    return (near & (np.abs(missed).max(1, initial=0.0) <= FAR)).all(1), weight
