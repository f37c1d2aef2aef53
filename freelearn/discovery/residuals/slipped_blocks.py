"""Blocks of readings that slipped together: a zero that jumps from a row on, or another scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.data.rows import Rows
from freelearn.discovery.fits.step import Step
from freelearn.discovery.noise.linear_algebra import orthonormal
from freelearn.discovery.noise.shapes import rows_of_samples
from freelearn.discovery.noise.structure import structure
from freelearn.discovery.residuals.suspects import Suspect
from freelearn.discovery.thresholds import ALPHA_STRUCTURE, BLOCK

ZERO, SCALE = "zero", "scale"
MOST = 4
# A block holds at least this share of its sample's states, and so many, and leaves as many out.
SMALLEST_SHARE, FEWEST = 0.1, 3


@dataclass(frozen=True)
class Block:
    """Rows (n,) of which one load slipped together. size: of the jump [N, N·m], or of the scale's change, a share;
    gain: reduction of χ² that it explains."""

    rows: np.ndarray
    load: int
    kind: str
    size: float
    gain: float

    def suspect(self, rows: Rows, kept: np.ndarray, in_order_of: Sequence[str] = ()) -> Suspect:
        """The block as a suspect: its first row, and what all have in common.

        in_order_of: inputs in whose order the states were measured: where a block begins, something may begin in them.
        """
        quantity = rows.states.bed.readings[self.load]
        place = tuple(int(p) for p in np.flatnonzero(kept)[self.rows])
        shown = float(rows.loads[self.rows[0], self.load])
        if self.kind == ZERO:
            expected = shown - self.size
            change = f"{self.size / quantity.factor:+.3g} {quantity.unit}"
            slip = f"zero jump by {change} from here on, {len(place)} rows"
        else:
            expected = shown / (1 + self.size)
            slip = f"a block of {len(place)} rows with another scale: {1 + self.size:.3g} times"
        if in_order_of:
            names = " or ".join(in_order_of)
            slip += f"; or something that depends on {names}, in whose order the states were measured"
        sigmas = float(np.sign(shown - expected)) * self.gain**0.5
        return Suspect(place[0], quantity.name, shown, expected, sigmas, slip, place)


@dataclass(frozen=True)
class Blocks:
    """Blocks that together explain what a step leaves, if `left`, the chance that what remains is noise, says so."""

    found: list[Block]
    left: float

    @property
    def gain(self) -> float:
        """Reduction of χ², less what so many blocks would take of noise, each at the best of hundreds of places."""
        return sum(block.gain - BLOCK / 2 for block in self.found)

    @property
    def explain(self) -> bool:
        """Whether nothing systematic remains with them."""
        return bool(self.found) and self.left >= ALPHA_STRUCTURE


def blocks(step: Step, rows: Rows) -> Blocks:
    """The blocks that explain most of a step's residuals, one for each sample and load at most, the best first."""
    residual, jacobian = step.fit.residual.reshape(-1), step.fit.jacobian
    found: list[Block] = []
    while len(found) < MOST:
        absorbed = orthonormal(jacobian.flatten(0, 1))
        rest = residual - absorbed @ (absorbed.T @ residual)
        best = _best(step, rows, absorbed, rest, {(int(rows.states.sample[b.rows[0]]), b.load) for b in found})
        if best is None or best.gain < BLOCK:
            break
        found.append(best)
        jacobian = torch.cat([jacobian, step.whiten(_column(best, step, rows))], dim=2)
    absorbed = orthonormal(jacobian.flatten(0, 1))
    rest = (residual - absorbed @ (absorbed.T @ residual)).reshape(-1, 2)
    return Blocks(found, structure(rest, jacobian, step.states, step.whiten).p_value if found else step.left.p_value)


def _column(block: Block, step: Step, rows: Rows) -> Tensor:
    column = torch.zeros(len(rows), 2, 1, dtype=torch.float64)
    chosen = torch.as_tensor(block.rows)
    column[chosen, block.load, 0] = step.fit.shown[chosen, block.load] if block.kind == SCALE else 1.0
    return column * step.whiten.told[..., None]


def _best(step: Step, rows: Rows, absorbed: Tensor, residual: Tensor, taken: set[tuple[int, int]]) -> Block | None:
    """A block begins with a kinematic state, and ends with another one or with its sample."""
    state, best = torch.as_tensor(rows.state), None
    for own in rows_of_samples(rows.states):
        _, level = torch.unique_consecutive(state[own], return_inverse=True)
        inside = torch.zeros(len(state), int(level.max()) + 1, dtype=torch.float64)
        inside[own] = (level[:, None] >= torch.arange(inside.shape[1])).double()
        for load in (0, 1):
            if (int(rows.states.sample[own[0]]), load) in taken:
                continue
            for kind in (ZERO, SCALE):
                # Loads as the model has them: those measured would make every residual look like a wrong scale.
                told = inside * step.whiten.told[:, load, None]
                columns = told * step.fit.shown[:, load, None] if kind == SCALE else told
                for start, stop, (gain, size) in _scan(columns, load, step, absorbed, residual):
                    if best is None or gain > best.gain:
                        chosen = own[(level >= start) & (level < stop)].numpy()
                        best = Block(chosen, load, kind, size, gain)
    return best


def _scan(
    columns: Tensor, load: int, step: Step, absorbed: Tensor, residual: Tensor
) -> list[tuple[int, int, tuple[float, float]]]:
    """The best block from a state to the sample's end, and the best that ends before: (first, last + 1, (gain, size)).

    columns (N, k): of the blocks from state 0, 1, … k − 1 on."""
    loads = torch.zeros(len(columns), 2, columns.shape[1], dtype=torch.float64)
    loads[:, load] = columns
    white = step.whiten(loads).flatten(0, 1)
    white = white - absorbed @ (absorbed.T @ white)
    gram, along = white.T @ white, -(white.T @ residual)
    count = len(gram)
    if count < 3 * FEWEST:
        return []
    to_end = along.square() / gram.diagonal().clamp_min(1e-300)
    # Nearly the whole sample is an offset or a gain, which are effects, and a few states are no block.
    few = max(int(SMALLEST_SHARE * count), FEWEST)
    to_end[:few] = to_end[count - few :] = 0
    out = []
    start = int(to_end.argmax())
    out.append((start, count, _size(along[start], gram[start, start])))
    # From i to j: the difference of two that go to the end.
    between = along[:, None] - along[None]
    norm = gram.diagonal()[:, None] + gram.diagonal()[None] - 2 * gram
    gains = torch.where(torch.ones(count, count).triu(1).bool(), between.square() / norm.clamp_min(1e-12), 0.0)
    longest = torch.arange(count)[None] - torch.arange(count)[:, None]
    gains[(longest < few) | (longest > count - few)] = 0
    i, j = divmod(int(gains.argmax()), count)
    if gains[i, j] > to_end[start] + BLOCK:
        out.append((i, j, _size(between[i, j], norm[i, j])))
    return out


def _size(along: Tensor, norm: Tensor) -> tuple[float, float]:
    # Residuals are predicted − measured: what was measured too high is a positive jump.
    return float(along**2 / norm.clamp_min(1e-300)), float(along / norm.clamp_min(1e-300))
