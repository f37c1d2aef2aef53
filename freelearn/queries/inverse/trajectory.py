"""What to impose along a log so that its readings are those wished: all samples of a stretch of time at once.

The readings of a recording are a function of what was imposed at all of its samples so far. That function is inverted
by Gauss and Newton's method within bounds, on stretches of samples that overlap: the first part of each is kept, so
that what comes late (a lag, a dead time) is asked for in time. Sample by sample, the inverse of a lag would answer each
corner with a swing of the pressure that does not end. A small weight on the bends of what is found keeps it smooth;
where each reading follows at once it moves no answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
import torch
from torch import Tensor

from freelearn.data.recordings import Recording
from freelearn.data.states import States

# Samples found at once, and how many of these are kept while others follow.
STRETCH, KEPT = 400, 200
# Weights beside the squares of misses, in shares of what each counts in: of second differences, and of pressures.
BENDS, SIZE = 1e-5, 1e-11
# Steps at most; a step, in shares of the room to look in, or a gain, in shares of the cost, after which none follows.
STEPS, STILL, STALLS = 40, 1e-10, 1e-6
# What is missed where the model has no answer, in what readings count in.
LOST = 100.0
# Costs of misses that nobody sees.
NOTHING = 1e-22
# Damping of a step: at first, and after one that did not help.
DAMPED, HARDER = 1e-9, 30.0
# Times that a bound is set to what a step would pass, in one step.
FACES = 20

# ∂readings/∂ one input of some samples: (M, 2, n).
Slopes = Callable[[Recording[States], Tensor, int], Tensor]
# The states of all rows, and what the model says there (N, 2), at inputs (N, m).
Shown = Callable[[Tensor], tuple[States, Tensor]]


@dataclass(frozen=True)
class Wish:
    """What is asked of a log's N rows, in the quantities of its bed, SI.

    blank: inputs to find, (N, m) bool. wanted: readings wished, (N, 2), NaN where none is. low, high: bounds of the
    inputs, (N, m). room: what an input counts in, (m,). scale: what a reading counts in, (2,). recordings: the rows of
    each recording that asks for something.
    """

    blank: Tensor
    wanted: Tensor
    low: Tensor
    high: Tensor
    room: Tensor
    scale: Tensor
    recordings: Sequence[Tensor]


def pursued(wish: Wish, begin: Tensor, shown: Shown, slopes: Slopes) -> Tensor:
    """Inputs (N, m) whose readings are nearest to those wished, by least squares. begin: (N, m), without blanks."""
    x = torch.minimum(torch.maximum(begin, wish.low), wish.high)
    x = torch.where(wish.blank, x, begin)
    longest = max((len(rows) for rows in wish.recordings), default=0)
    for start in range(0, max(longest - STRETCH + KEPT, 1), KEPT):
        pieces = [
            Stretch(wish, rows, start, slopes) for rows in wish.recordings if not start or len(rows) > start + KEPT
        ]
        x = _solved([piece for piece in pieces if piece.count], x, shown)
    return x


def _solved(pieces: list[Stretch], x: Tensor, shown: Shown) -> Tensor:
    """Inputs with those of each recording's stretch found."""
    states, y = shown(x)
    for piece in pieces:
        piece.begin(states, x, y)
    for _ in range(STEPS):
        going = [piece for piece in pieces if piece.goes]
        if not going:
            break
        trial = x
        for piece in going:
            trial = piece.tried(trial)
        states, y = shown(trial)
        for piece in going:
            x = piece.judged(states, x, trial, y)
    return x


@dataclass
class Stretch:
    """A stretch of one recording, from one of its samples on, that is being solved."""

    wish: Wish
    rows: Tensor
    start: int
    slopes: Slopes
    goes: bool = True
    damping: float = DAMPED
    cost: float = field(init=False, default=np.inf)

    def __post_init__(self) -> None:
        self.stop = min(self.start + STRETCH, len(self.rows))
        own = self.rows[self.start : self.stop]
        # Sample and quantity of each unknown, one quantity after the other, and its number among a quantity's.
        self.quantity, self.sample = torch.nonzero(self.wish.blank[own].T, as_tuple=True)
        self.row = own[self.sample]
        self.unit = self.wish.room[self.quantity].numpy()
        self.low, self.high = (
            edge[self.row, self.quantity].numpy() / self.unit for edge in (self.wish.low, self.wish.high)
        )
        self.wanted = self.wish.wanted[own]
        self.there = torch.isfinite(self.wanted)

    @property
    def count(self) -> int:
        """How many inputs are to be found."""
        return len(self.row)

    def begin(self, states: States, x: Tensor, y: Tensor) -> None:
        """At inputs (N, m) whose readings are y (N, 2)."""
        self.cost = self._cost(x, y)
        self._linear(states, x, y)
        self.goes = self.cost > NOTHING

    def tried(self, x: Tensor) -> Tensor:
        """The inputs with one step made."""
        z = self.unknown(x)
        curvature = self.curvature + self.damping * np.diag(self.curvature.diagonal() + 1e-12)
        step = _within(curvature, self.slope, self.low - z, self.high - z)
        self.step = float(np.abs(step).max())
        moved = x.clone()
        moved[self.row, self.quantity] = torch.as_tensor((z + step) * self.unit)
        return moved

    def judged(self, states: States, x: Tensor, trial: Tensor, y: Tensor) -> Tensor:
        """The inputs with the step kept, where it helps."""
        cost = self._cost(trial, y)
        if not cost < self.cost:
            self.damping *= HARDER
            self.goes = self.step > STILL and self.damping < 1e9
            return x
        gained, self.cost, self.damping = self.cost - cost, cost, max(self.damping / HARDER, DAMPED)
        kept = x.clone()
        kept[self.row, self.quantity] = trial[self.row, self.quantity]
        self.goes = self.step > STILL and gained > STALLS * cost and cost > NOTHING
        if self.goes:
            self._linear(states, kept, y)
        return kept

    def rates(self, states: States) -> Tensor:
        """∂readings of the stretch/∂ what is to be found, (n, 2, count) SI, zero where there is none. states: of all
        rows."""
        parts = [
            self.response(states, self.sample[self.quantity == quantity] + self.start, quantity)
            for quantity in self.quantity.unique().tolist()
        ]
        return torch.cat(parts, dim=-1)

    def response(self, states: States, samples: Tensor, quantity: int) -> Tensor:
        """∂readings of the stretch/∂ one input of some samples (k,) of its recording until its end: (n, 2, k) SI."""
        assert states.recording is not None
        rate = self.slopes(states.recording[self.rows[: self.stop]], samples, quantity)[self.start :]
        return rate.nan_to_num(nan=0.0, posinf=0.0, neginf=0.0)

    def weighed(self, rates: Tensor) -> np.ndarray:
        """The same as the cost counts them, (2n, count): in shares of scale and room, where something is wished."""
        shares = rates * torch.as_tensor(self.unit) / self.wish.scale[:, None]
        counted: np.ndarray = torch.where(self.there[..., None], shares, 0.0).reshape(-1, self.count).numpy()
        return counted

    def curvature_of(self, jacobian: np.ndarray, bends: np.ndarray) -> np.ndarray:
        """Of half the cost by the unknowns, (count, count)."""
        found: np.ndarray = jacobian.T @ jacobian + BENDS * bends.T @ bends + SIZE * np.eye(self.count)
        return found

    def _linear(self, states: States, x: Tensor, y: Tensor) -> None:
        """Slope and curvature of half the cost by the unknowns, in units of their room."""
        jacobian = self.weighed(self.rates(states))
        bends, bent = self.bends(x)
        z = self.unknown(x) * (self.quantity >= 2).numpy()
        self.slope = jacobian.T @ self._missed(y).reshape(-1) + BENDS * bends.T @ bent + SIZE * z
        self.curvature = self.curvature_of(jacobian, bends)

    def _cost(self, x: Tensor, y: Tensor) -> float:
        missed, (_, bent) = self._missed(y), self.bends(x)
        z = self.unknown(x) * (self.quantity >= 2).numpy()
        cost = (missed**2).sum() + BENDS * (bent**2).sum() + SIZE * (z**2).sum()
        return float(cost) if np.isfinite(cost) else np.inf

    def _missed(self, y: Tensor) -> np.ndarray:
        """Readings less those wished, in what they count in: (n, 2), zero where none is."""
        own = y[self.rows[self.start : self.stop]]
        missed = torch.where(self.there, (own - self.wanted) / self.wish.scale, 0.0)
        found: np.ndarray = missed.nan_to_num(nan=LOST, posinf=LOST, neginf=-LOST).numpy()
        return found

    def bends(self, x: Tensor) -> tuple[np.ndarray, np.ndarray]:
        """Second differences of each quantity that is found, of this stretch and of two samples before it, (k,), behind
        their derivatives by the unknowns (k, count)."""
        rows = self.rows[max(self.start - 2, 0) : self.stop]
        ahead = self.start - max(self.start - 2, 0)
        number = len(rows) - 2
        derivatives, values = [], []
        for quantity in self.quantity.unique().tolist():
            own = self.quantity == quantity
            second = np.diff(x[rows, quantity].numpy() / float(self.wish.room[quantity]), n=2)
            matrix = np.zeros((max(number, 0), self.count))
            column, place = torch.nonzero(own)[:, 0].numpy(), self.sample[own].numpy() + ahead
            for shift, factor in ((0, 1.0), (1, -2.0), (2, 1.0)):
                row = place - shift
                inside = (row >= 0) & (row < number)
                matrix[row[inside], column[inside]] = factor
            derivatives.append(matrix)
            values.append(second)
        return np.concatenate(derivatives), np.concatenate(values)

    def unknown(self, x: Tensor) -> np.ndarray:
        """What is to be found, in units of its room, (count,)."""
        z: np.ndarray = x[self.row, self.quantity].numpy() / self.unit
        return z


def _within(curvature: np.ndarray, slope: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The step (n,) of least ½ sᵀ H s + gᵀ s with low ≤ s ≤ high, as far as a few sets of bounds tell."""
    step = np.zeros_like(slope)
    # Those that lie at a bound and would go on.
    free = ~((low >= 0) & (slope > 0) | (high <= 0) & (slope < 0))
    for _ in range(FACES):
        if not free.any():
            break
        held = np.where(free, 0.0, step)
        pull = slope[free] + curvature[np.ix_(free, ~free)] @ held[~free]
        factor = scipy.linalg.cho_factor(curvature[np.ix_(free, free)], check_finite=False)
        step[free] = -scipy.linalg.cho_solve(factor, pull, check_finite=False)
        beyond = free & ((step < low) | (step > high))
        step = np.clip(step, low, high)
        if not beyond.any():
            break
        free &= ~beyond
    return step
