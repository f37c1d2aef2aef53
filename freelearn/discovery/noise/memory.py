"""Noise with a memory: in a log, a part of a reading's error that is still there when the next one is taken.

Each channel errs by white noise and by a Gauss–Markov process (Ornstein & Uhlenbeck 1930) that begins anew with every
recording: of its error variance a share f is remembered, with the correlation e^(−Δt/τ) over a time Δt. Both are known
from the shares and times alone, so uneven sampling and gaps are exact. Whitening takes off what the earlier readings
let expect (Kalman's filter, 1960); its gains do not depend on the readings, so that it is a banded triangular system.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.linalg.lapack import dtbtrs
from torch import Tensor

# Largest share (nothing can be divided by what a perfect memory leaves), and logarithm of the odds of the least tried.
MOST, LEAST = 0.99, -3.0
# Log-likelihood by which noise with a memory must do better than white noise.
WORTH = 6.0
# Shares and times that are tried at first, and then about the best of them, closer and closer.
SHARES, TIMES = 7, 12
CLOSER, ROUNDS = 5, 4
# Times, of the usual step from row to row and of the longest recording.
SHORTEST, LONGEST = 0.3, 0.5
# Rows of a recording that are followed in one piece, and such pieces at most.
PIECE, PIECES = 400, 60


@dataclass(frozen=True)
class Memory:
    """share (2,): of each channel's error variance that has a memory; time (2,): in which all but 1/e of such an error
    is forgotten [s]."""

    share: Tensor
    time: Tensor


class Filter:
    """Turns rows (N, 2, k) whose errors have a memory into innovations of variance one."""

    def __init__(self, memory: Memory, kept: Tensor, white: Tensor, visit: Tensor, clock: Tensor) -> None:
        """kept, white (N, 2): variance of the part with a memory, and of the other one. visit (N,) int64: number of
        each row's recording, whose rows follow each other; clock (N,): time of each row [s]."""
        step = clock.diff(prepend=clock[:1])
        again = torch.ones_like(visit, dtype=torch.bool)
        again[1:] = visit[1:] != visit[:-1]
        left = torch.exp(-step.clamp_min(0.0)[:, None] / memory.time)
        # What one row hands on to the next: nothing across recordings.
        self.left = torch.where(again[:, None], 0.0, left)
        self.loading = kept.sqrt()
        gain, size = np.empty(kept.shape), np.empty(kept.shape)
        for channel in range(2):
            gain[:, channel], size[:, channel] = _gains(
                self.left[:, channel].tolist(), self.loading[:, channel].tolist(), white[:, channel].tolist()
            )
        self.gain, self.size = torch.as_tensor(gain), torch.as_tensor(size)

    def part(self, rows: Tensor) -> Filter:
        """Of some whole recordings' rows (n,) int64."""
        part = object.__new__(Filter)
        for name, value in vars(self).items():
            setattr(part, name, value[rows])
        return part

    def innovations(self, columns: Tensor) -> Tensor:
        """(N, 2, k) → the same, white."""
        found = torch.empty_like(columns)
        for channel in range(2):
            own, gain, loading = columns[:, channel], self.gain[:, channel], self.loading[:, channel]
            expected = self._carried(channel, 1 - gain * loading, gain[:, None] * own)
            found[:, channel] = (own - loading[:, None] * expected) / self.size[:, channel, None]
        return found

    def colored(self, white: Tensor) -> Tensor:
        """White noise (N, 2) of variance one → the noise that it is the innovations of."""
        found = torch.empty_like(white)
        for channel in range(2):
            own = white[:, channel, None] * self.size[:, channel, None]
            expected = self._carried(channel, torch.ones(len(own), dtype=own.dtype), self.gain[:, channel, None] * own)
            found[:, channel] = (own + self.loading[:, channel, None] * expected)[:, 0]
        return found

    def _carried(self, channel: int, kept: Tensor, added: Tensor) -> Tensor:
        """m (N, k) with mₙ₊₁ = φₙ₊₁ (keptₙ mₙ + addedₙ), zero at the first row of a recording."""
        left = self.left[:, channel]
        if not added.shape[1]:
            # Of no right-hand side LAPACK writes beyond its end.
            return added
        band = np.ones((2, len(left)), order="F")
        band[1, :-1] = -(left[1:] * kept[:-1]).numpy()
        known = torch.zeros_like(added)
        known[1:] = left[1:, None] * added[:-1]
        solved = dtbtrs(band, np.asfortranarray(known.numpy()), uplo="L", trans="N", diag="U")[0]
        return torch.as_tensor(np.ascontiguousarray(solved))


def _gains(left: list[float], loading: list[float], white: list[float]) -> tuple[list[float], list[float]]:
    """Of each row the gain of Kalman's filter and the standard deviation of its innovation: the variance of a process
    of variance one is known to be p before a reading, and p (1 − g h) after it."""
    gains, sizes, known = [], [], 1.0
    for phi, h, own in zip(left, loading, white, strict=True):
        known = phi * phi * known + 1 - phi * phi
        size = h * h * known + own
        gain = known * h / size
        gains.append(gain)
        sizes.append(size**0.5)
        known *= 1 - gain * h
    return gains, sizes


def remembered(errors: Tensor, weight: Tensor, visit: Tensor, clock: Tensor) -> Memory | None:
    """The memory of errors (N, 2) of like size by maximum likelihood; None where white noise does as well.

    weight (N, 2): precision of each one's white part, zero for what does not count."""
    at = visit.numpy(), clock.numpy()
    found = [_of_one(errors[:, i].numpy(), weight[:, i].numpy(), *at) for i in range(errors.shape[1])]
    if not any(share for share, _ in found):
        return None
    share, time = torch.tensor(found, dtype=torch.float64).unbind(1)
    return Memory(share, time)


def _of_one(error: np.ndarray, weight: np.ndarray, visit: np.ndarray, clock: np.ndarray) -> tuple[float, float]:
    """Share and time of one channel."""
    counts = np.flatnonzero(weight > 0)
    pieces = _pieces(counts, visit)
    steps = np.concatenate([np.diff(clock[p]) for p in pieces]) if pieces else np.zeros(0)
    steps = steps[steps > 0]
    if len(steps) < PIECE // 20:
        return 0.0, 1.0
    shortest = SHORTEST * float(np.median(steps))
    longest = max(LONGEST * max(float(np.ptp(clock[p])) for p in pieces), 2 * shortest)
    most, ends = np.log(MOST / (1 - MOST)), (np.log(shortest), np.log(longest))
    logit, log = np.linspace(LEAST, most, SHARES), np.linspace(*ends, TIMES)
    fitted = _Pieces(pieces, error, weight, clock)
    white = fitted.misfit(np.zeros(1), np.ones(1))[0]
    for _ in range(ROUNDS):
        tried = np.stack(np.meshgrid(logit, log, indexing="ij"), -1).reshape(-1, 2)
        misfits = fitted.misfit(1 / (1 + np.exp(-tried[:, 0])), np.exp(tried[:, 1]))
        best, least = tried[misfits.argmin()], float(misfits.min())
        wide = (logit[1] - logit[0]), (log[1] - log[0])
        logit = np.clip(np.linspace(best[0] - wide[0], best[0] + wide[0], CLOSER), LEAST, most)
        log = np.clip(np.linspace(best[1] - wide[1], best[1] + wide[1], CLOSER), *ends)
    if white - least < 2 * WORTH:
        return 0.0, 1.0
    return float(1 / (1 + np.exp(-best[0]))), float(np.exp(best[1]))


def _pieces(rows: np.ndarray, visit: np.ndarray) -> list[np.ndarray]:
    """Rows (n,) cut where another recording begins and into pieces, as many as tell enough, evenly drawn."""
    own = np.split(rows, np.flatnonzero(np.diff(visit[rows])) + 1) if len(rows) else []
    pieces = [part for each in own for part in np.array_split(each, -(-len(each) // PIECE)) if len(part) > 1]
    if len(pieces) <= PIECES:
        return pieces
    return [pieces[i] for i in np.linspace(0, len(pieces) - 1, PIECES).round().astype(int)]


class _Pieces:
    """Pieces of recordings side by side: (pieces, rows), the shorter ones filled up with rows that do not count."""

    def __init__(self, pieces: list[np.ndarray], error: np.ndarray, weight: np.ndarray, clock: np.ndarray) -> None:
        longest = max(map(len, pieces))
        self.error, self.weight, self.step = (np.zeros((longest, len(pieces), 1)) for _ in range(3))
        for i, rows in enumerate(pieces):
            self.error[: len(rows), i, 0] = error[rows] * np.sqrt(weight[rows])
            self.weight[: len(rows), i, 0] = weight[rows]
            self.step[1 : len(rows), i, 0] = np.diff(clock[rows])
        self.count = sum(map(len, pieces))

    def misfit(self, share: np.ndarray, time: np.ndarray) -> np.ndarray:
        """−2 log likelihood (g,) of shares and times (g,), of errors of whatever size."""
        known, mean = np.ones((self.error.shape[1], len(share))), np.zeros((self.error.shape[1], len(share)))
        squares, sizes = np.zeros_like(mean), np.zeros_like(mean)
        for error, weight, step in zip(self.error, self.weight, self.step, strict=True):
            left = np.exp(-step / time)
            known = left**2 * (known - 1) + 1
            mean = left * mean
            loading = np.sqrt(share * weight)
            size = loading**2 * known + (1 - share)
            gain = known * loading / size
            off = error - loading * mean
            squares += np.where(weight > 0, off**2 / size, 0.0)
            sizes += np.where(weight > 0, np.log(size), 0.0)
            mean = mean + gain * off
            known = known * (1 - gain * loading)
        scale = np.maximum(squares.sum(0) / self.count, 1e-300)
        found: np.ndarray = self.count * np.log(scale) + sizes.sum(0)
        return found
