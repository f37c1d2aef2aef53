"""Nominal stress against stretch: measured, and what rubbers fitted alike say, as numbers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import torch

from freelearn.fit.rubber import RubberFit
from freelearn.mechanics.mode import MPA

POINTS = 200
COLUMNS = ["source", "mode", "specimen", "stretch", "stress_mpa", "fitted"]


def curve_table(table: pd.DataFrame, fits: Mapping[str, RubberFit]) -> pd.DataFrame:
    """The rows measured (source "measured") and each fit's curve over its mode's stretches (source: the fit's name).

    Columns: source, mode, specimen, stretch, stress_mpa, fitted (whether the mode was).
    """
    modes = next(iter(fits.values())).modes
    rows = [table.assign(source="measured", fitted=table["mode"].map({m: e.fitted for m, e in modes.items()}))]
    for name, fit in fits.items():
        values = {n: torch.tensor(v, dtype=torch.float64) for n, v in fit.values.items()}
        for mode, error in fit.modes.items():
            own = table.loc[table["mode"] == mode, "stretch"]
            stretch = np.linspace(min(1.0, own.min()), max(1.0, own.max()), POINTS)
            stress = fit.rubber.stress(values, mode, torch.tensor(stretch)).numpy() / MPA
            curve = {"source": name, "mode": mode, "specimen": "", "stretch": stretch, "stress_mpa": stress}
            rows.append(pd.DataFrame({**curve, "fitted": error.fitted}))
    return pd.concat(rows, ignore_index=True)[COLUMNS]
