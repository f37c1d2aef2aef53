"""How far the inputs found along a log may be off: what is missed at one sample moves the answers of others.

What is missed is m = J_θ δθ + J_s δs + e: of parameters θ, of what a whole recording is shifted by, s (a mounting), the
same along it; of the readings e, each by itself. The least squares that found x answer it by δx = −G m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.data.states import States
from freelearn.queries.inverse.trajectory import KEPT, STRETCH, Slopes, Stretch, Wish

# An input this near to a bound, in shares of its room, is held there.
AT_BOUND = 1e-9


@dataclass(frozen=True)
class Sources:
    """What is not known. shared: derivatives of the readings by what is the same along a recording, (N, 2, q);
    covariance (q, q) of that. white: covariance (2, 2) of a reading's own error."""

    shared: Tensor
    covariance: Tensor
    white: Tensor


def log_deviations(wish: Wish, states: States, x: Tensor, slopes: Slopes, of: Sources) -> tuple[Tensor, Tensor]:
    """Standard deviations of the inputs found (N, m), and of what is read there (N, 2), SI; NaN in recordings that ask
    for nothing. x: (N, m), states: those at x.

    Of samples before a stretch what is shared is carried on; what each of their readings errs by itself is not.
    """
    inputs, outputs = torch.full_like(x, torch.nan), torch.full_like(wish.wanted, torch.nan)
    for rows in wish.recordings:
        # By how much what is shared moves each input found, (rows, m, q).
        moved = torch.zeros(len(rows), x.shape[1], of.shared.shape[-1], dtype=x.dtype)
        for start in range(0, max(len(rows) - STRETCH + KEPT, 1), KEPT):
            stretch = Stretch(wish, rows, start, slopes)
            own = rows[stretch.start : stretch.stop]
            inputs[own], outputs[own] = _of_stretch(stretch, states, x, of, moved)
    return inputs, outputs


def _of_stretch(stretch: Stretch, states: States, x: Tensor, of: Sources, moved: Tensor) -> tuple[Tensor, Tensor]:
    """Of its samples: (n, m) and (n, 2). moved: of the recording so far, whose part of the stretch is written."""
    own = stretch.rows[stretch.start : stretch.stop]
    count = len(own)
    missed = (of.shared[own] + _from_before(stretch, states, moved)).reshape(2 * count, -1).numpy()
    z, rates = stretch.unknown(x), stretch.rates(states)
    free = (z > stretch.low + AT_BOUND) & (z < stretch.high - AT_BOUND)
    jacobian = stretch.weighed(rates)
    curvature = stretch.curvature_of(jacobian, stretch.bends(x)[0])[np.ix_(free, free)]
    scale = stretch.wish.scale.repeat(count).numpy()
    answer = np.zeros((stretch.count, 2 * count))
    answer[free] = -np.linalg.solve(curvature, jacobian[:, free].T / scale) * stretch.unit[free, None]
    rate = rates.reshape(2 * count, -1).numpy()
    found = answer @ missed
    common, white = _root(of.covariance.numpy()), _root(of.white.numpy())

    def deviation(by_shared: np.ndarray, by_reading: np.ndarray) -> Tensor:
        each = by_reading.reshape(len(by_reading), count, 2) @ white
        return torch.as_tensor(np.sqrt(((by_shared @ common) ** 2).sum(1) + (each**2).sum((1, 2))))

    inputs = torch.zeros(count, x.shape[1], dtype=x.dtype)
    inputs[stretch.sample, stretch.quantity] = deviation(found, answer)
    moved[stretch.sample + stretch.start, stretch.quantity] = torch.as_tensor(found)
    outputs = deviation(missed + rate @ found, np.eye(2 * count) + rate @ answer)
    return inputs, outputs.reshape(count, 2)


def _from_before(stretch: Stretch, states: States, moved: Tensor) -> Tensor:
    """What is missed because inputs found before the stretch are off by what is shared, (n, 2, q)."""
    found = torch.zeros(stretch.stop - stretch.start, 2, moved.shape[-1], dtype=moved.dtype)
    past = torch.arange(max(stretch.start - KEPT, 0), stretch.start)
    for quantity in range(moved.shape[1]):
        asked = past[stretch.wish.blank[stretch.rows[past], quantity]]
        if len(asked):
            found += torch.einsum("ncs,sq->ncq", stretch.response(states, asked, quantity), moved[asked, quantity])
    return found


def _root(covariance: np.ndarray) -> np.ndarray:
    """R with R Rᵀ a covariance (q, q), which may have no inverse."""
    size, axes = np.linalg.eigh(covariance)
    found: np.ndarray = axes * np.sqrt(size.clip(0))
    return found
