"""Zeros of many functions of one variable at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
MOST = 100


def bracketed_zero(function: Callable[[Array], Array], low: Array, high: Array, tolerance: float) -> Array:
    """Where functions (N,) → (N,) vanish between low, where they are below zero, and high, where they are above: (N,).

    Chandrupatla (1997): inverse quadratic interpolation where the last three points bend little, else halving. NaN
    counts as above zero. Ends once every bracket is within tolerance times its first width, or its value is zero.
    """

    def value(at: Array) -> Array:
        found = function(at)
        return np.where(np.isnan(found), np.inf, found)

    # The latest point, the other end of its bracket, and the one before.
    x1, x2 = high.astype(float), low.astype(float)
    f1, f2 = value(x1), value(x2)
    done = (f1 == 0) | (f2 == 0)
    share, close = np.where(done, 0.0, 0.5), tolerance * np.abs(high - low)
    for _ in range(MOST):
        x = x1 + share * (x2 - x1)
        f = value(x)
        same = (f > 0) == (f1 > 0)
        x3, f3 = np.where(same, x1, x2), np.where(same, f1, f2)
        x2, f2 = np.where(same | done, x2, x1), np.where(same | done, f2, f1)
        x1, f1 = np.where(done, x1, x), np.where(done, f1, f)
        with np.errstate(invalid="ignore", divide="ignore"):
            least = close / np.abs(x2 - x1)
            done |= (f1 == 0) | ~(least < 0.5)
            if done.all():
                break
            place, level = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2)
            smooth = (level**2 < place) & ((1 - level) ** 2 < 1 - place)
            bent = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        share = np.clip(np.where(smooth & np.isfinite(bent), bent, 0.5), least, 1 - least)
        share = np.where(done, 0.0, share)
    return np.where(np.abs(f1) <= np.abs(f2), x1, x2)
