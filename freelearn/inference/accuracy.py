"""How accurate the measuring was, judged from the data."""

from __future__ import annotations

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from freelearn.inference.linear_algebra import orthonormal
from freelearn.inference.noise import Whitener
from freelearn.inference.shapes import bases, dense
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.states import States

MAD = 1.4826  # of a normal distribution: standard deviation over median absolute deviation
# Repeats of a state count as such within these distances.
SAME_MM, SAME_DEG, SAME_KPA = 0.5, 1.0, 1.0
FEWEST_REPEATS = 10


def estimate(
    raw: Tensor, jacobian: Tensor, sensitivity: Tensor, states: States, state: np.ndarray, like: Accuracy
) -> Accuracy:
    """Accuracy from the scatter about everything smooth. raw: predicted − measured (N, 2) of some fit.

    Smooth functions of the inputs are taken off the residuals first. In what is left, a state's common part along
    ∂(F, M)/∂(l, φ) is its position error, and the rest the load cells' scatter. `like` gives the ratio of length to
    twist error and the pressure error, which cannot be told from the load cells' own. Medians, so that a few odd states
    do not decide.
    """
    scale = raw.abs().amax(0).clamp_min(1e-300)
    flat = (raw / scale).reshape(-1)
    basis = dense(bases(states)[-1], len(states))
    zero = torch.zeros_like(basis)
    both = torch.cat([torch.stack([basis, zero], 1), torch.stack([zero, basis], 1)], dim=2).flatten(0, 1)
    own = (jacobian / scale[:, None]).flatten(0, 1)
    span = orthonormal(torch.cat([both, own / own.norm(dim=0).clamp_min(1e-300)], dim=1))
    left = ((flat - span @ (span.T @ flat)).reshape(-1, 2) * scale).numpy()
    # Smooth functions took some of the scatter with them.
    left = left / np.sqrt(1 - span.shape[1] / len(flat))
    position = (sensitivity[:, :, :2] * torch.tensor([like.length, like.twist], dtype=torch.float64)).numpy()
    rests, moves = [], []
    order = np.argsort(state, kind="stable")
    unit = scale.numpy()
    for rows in np.split(order, np.flatnonzero(np.diff(state[order])) + 1):
        if len(rows) < 3:
            continue
        design = (position[rows] / unit[:, None]).reshape(-1, 2)
        target = (left[rows] / unit).reshape(-1)
        move = np.linalg.lstsq(design, target, rcond=1e-8)[0]
        rests.append(((target - design @ move).reshape(-1, 2) * unit) / np.sqrt(1 - 1 / len(rows)))
        moves.append(move)
    if len(rests) < 5:
        deviation = MAD * np.median(np.abs(left), axis=0)
        return Accuracy(0.0, 0.0, 0.0, *(float(max(d, 1e-12)) for d in deviation))
    deviation = MAD * np.median(np.abs(np.concatenate(rests)), axis=0)
    ratio = float(MAD * np.median(np.abs(np.array(moves))))
    force, moment = (float(max(d, 1e-12)) for d in deviation)
    return Accuracy(ratio * like.length, ratio * like.twist, 0.0, force, moment)


def repeat_scale(table: pd.DataFrame, state: np.ndarray, residual: Tensor, whiten: Whitener) -> float | None:
    """Scatter between repeats of one state and pressure, in units of the stated noise; None with too few repeats.

    residual: predicted − measured (N, 2) N, N·m; a model's own error is the same in a repeat and drops out.
    """
    keys = pd.DataFrame(
        {
            "sample": table["sample"].to_numpy(),
            "l": (table["elongation_mm"].to_numpy() / SAME_MM).round(),
            "t": (table["twist_deg"].to_numpy() / SAME_DEG).round(),
            "p": (table["pressure_kpa"].to_numpy() / SAME_KPA).round(),
            "step": table["step"].to_numpy(),
        }
    )
    z = (residual / whiten.variance.sqrt()).numpy()
    squares = []
    for _, rows in keys.groupby(list(keys.columns)).indices.items():
        _, first = np.unique(state[rows], return_index=True)
        if len(first) > 1:
            several = z[np.asarray(rows)[first]]
            squares.append(((several - several.mean(0)) ** 2).sum(0) / (len(first) - 1))
    if len(squares) < FEWEST_REPEATS:
        return None
    return float(np.sqrt(np.mean(squares)))
