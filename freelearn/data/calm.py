"""What a signal along a measured log was without the noise of what the bed imposed.

An element that sticks until a load has changed by its threshold follows every flicker of a gauge: friction as small as
the noise takes it off the loads and fits them better, and a threshold that is there seems smaller, since the largest
reading before a turn is the one that the noise has raised. Where all that is imposed went straight through some rows, a
line through these says what a row was, with less noise (local linear smoothing: Cleveland, J. Am. Stat. Assoc. 74, 829,
1979).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial

import numpy as np
import torch
from torch import Tensor

# Rows beside the one that is asked for, on both sides together, that a line goes through; two at least.
WIDEST = 6
# Standard deviations of χ² by which rows may scatter about a line that they are on.
ABOUT = 2.0
# How far off one of them may be, in standard deviations of the noise.
FAR = 3.5
# Share of a signal's range below which nothing is noise.
SMALLEST = 1e-12

# So many rows before and behind, those first whose line says most of the row between.
_SIDES = [(before, every - before) for every in range(2, WIDEST + 1) for before in range(every + 1)]


def _spread(sides: tuple[int, int]) -> float:
    """Variance of a line's value at the row, of equally spaced ones with noise of variance one."""
    places = np.arange(-sides[0], sides[1] + 1)
    return float(1 / len(places) + places.mean() ** 2 / ((places - places.mean()) ** 2).sum())


WINDOWS = sorted(_SIDES, key=_spread)


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

    def of(self, signal: Tensor) -> Tensor:
        """A signal along the samples (M, c), every one on its line."""
        places, weights = (each.to(signal.device) for each in self.lines)
        return (signal[places] * weights[..., None].to(signal.dtype)).sum(1)


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
    places = np.repeat(np.arange(count)[:, None], WIDEST + 1, axis=1)
    weights = np.zeros((count, WIDEST + 1))
    weights[:, 0] = 1.0
    left = np.arange(count)
    for before, behind in WINDOWS:
        inside = left[(left >= before) & (left < count - behind)]
        inside = inside[piece[inside - before] == piece[inside + behind]]
        around = inside[:, None] + np.arange(-before, behind + 1)
        straight, weight = _straight(inputs[around] / sizes, time[around] - time[inside][:, None])
        found = inside[straight]
        places[found, : around.shape[1]] = around[straight]
        weights[found, : around.shape[1]] = weight[straight]
        left = np.setdiff1d(left, found, assume_unique=True)
    return torch.as_tensor(places), torch.as_tensor(weights)


def _straight(values: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of windows of samples (n, k), so long after the one asked for: whether all that is imposed, (n, k, i) in standard
    deviations of its noise, is straight there, (n,), and the weights of a line's value at that one, (n, k)."""
    number = values.shape[1]
    off = after - after.mean(1, keepdims=True)
    square = (off**2).sum(1, keepdims=True)
    weight = 1 / number - after.mean(1, keepdims=True) * off / square
    level = values - values.mean(1, keepdims=True)
    missed = level - ((level * off[..., None]).sum(1) / square)[:, None] * off[..., None]
    free = number - 2
    near = (missed**2).sum(1) <= free + ABOUT * (2 * free) ** 0.5
    return (near & (np.abs(missed).max(1, initial=0.0) <= FAR)).all(1), weight
