"""How a fit ended. Light to import: a fit that was kept is read without Lightning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from torch import Tensor


@dataclass(frozen=True)
class FitOutcome:
    """kept: training rows that took part, (N,) bool. initial: raw vector (p,) before the fit. history: epoch,
    training and validation error. converged: whether the fit came to its own end, not to a limit of iterations or to
    a point from where nothing helps; message: one sentence on how it ended."""

    kept: np.ndarray
    initial: Tensor
    history: list[tuple[int, float, float]]
    message: str
    converged: bool
