"""Nominal stress against stretch: measured, and what rubbers fitted alike say, as numbers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import torch

from freelearn.fitting.rubber import RubberFit
from freelearn.measurements.specimen_modes import MODES
from freelearn.mechanics.sheet import MPA

POINTS = 200
COLUMNS = ["source", "mode", "specimen", "stretch", "stretch_2", "stress_mpa", "stress_2_mpa", "fitted"]


def curve_table(table: pd.DataFrame, fits: Mapping[str, RubberFit]) -> pd.DataFrame:
    """The rows measured (source "measured") and each fit's curves over its modes' stretches (source: the fit's name).

    Columns: source, mode, specimen, stretch, stretch_2, stress_mpa, stress_2_mpa (blank where the mode did not measure
    it), fitted (whether the mode was).
    """
    modes = next(iter(fits.values())).modes
    rows = [table.assign(source="measured", fitted=table["mode"].map({m: e.fitted for m, e in modes.items()}))]
    for mode, error in modes.items():
        own = table[table["mode"] == mode]
        path = _path(own, mode)
        for name, fit in fits.items():
            rows.append(_curve(fit, path, own).assign(source=name, mode=mode, fitted=error.fitted))
    return pd.concat(rows, ignore_index=True)[COLUMNS]


def _path(rows: pd.DataFrame, mode: str) -> pd.DataFrame:
    """specimen, stretch, stretch_2 along a curve through a mode's rows, from rest where the mode tells the way."""
    if MODES[mode].power is not None:
        stretch = np.linspace(min(1.0, rows["stretch"].min()), max(1.0, rows["stretch"].max()), POINTS)
        return pd.DataFrame({"specimen": "", "stretch": stretch, "stretch_2": MODES[mode].across(stretch)})
    parts = []
    for specimen, own in rows.groupby("specimen", sort=False):
        place = np.linspace(0, len(own) - 1, POINTS)
        names = ("stretch", "stretch_2")
        way = {name: np.interp(place, np.arange(len(own)), own[name].to_numpy()) for name in names}
        parts.append(pd.DataFrame({"specimen": specimen, **way}))
    return pd.concat(parts, ignore_index=True)


def _curve(fit: RubberFit, path: pd.DataFrame, rows: pd.DataFrame) -> pd.DataFrame:
    """A path with the nominal stresses of a fit [MPa] in the directions in which a mode's rows hold some."""
    values = {name: torch.tensor(value, dtype=torch.float64) for name, value in fit.values.items()}
    one, two = (torch.tensor(path[name].to_numpy()) for name in ("stretch", "stretch_2"))
    along = fit.rubber.stress(values, one, two).numpy() / MPA
    across = fit.rubber.stress(values, two, one).numpy() / MPA
    shown = {"stress_mpa": along, "stress_2_mpa": across}
    return path.assign(**{n: stress if rows[n].notna().any() else np.nan for n, stress in shown.items()})
