"""Fitted actuators to export, without a fit, and what they answer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fitted_folders import continuum, folder_of, grid, shown

import freelearn

# Known to a hundredth each.
SHARE = 0.01


def actuator(folder: Path, effects: dict[str, dict[str, float]] | None = None, known: bool = True, **more):
    """A continuum with effects, as a run that was fitted to the simulated bed's third sample."""
    model = continuum(effects)
    values = np.array(list(model.scalars().values()))
    covariance = np.diag((SHARE * values) ** 2) if known else None
    table = shown(model, grid())
    return freelearn.load(folder_of(folder, model, table, covariance=covariance, **more))
