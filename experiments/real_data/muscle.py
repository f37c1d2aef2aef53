"""The muscle DMSP-20-300: largest errors of several models, on all rows and at a length left out of the fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from rich.table import Table

from freelearn.fit.levenberg_marquardt import LevenbergMarquardt
from freelearn.fit.problem import Problem
from freelearn.fit.starts import starts
from freelearn.measurements.beds import ISOMETRIC
from freelearn.measurements.rows import Rows
from freelearn.measurements.table import read_table
from freelearn.models.base import Model
from freelearn.models.build import build_model

# Martens & Boblan (2017): largest error of their model, nothing left out.
PUBLISHED = 2.35
MODELS = ([], ["fiber_misalignment"], ["fiber_misalignment", "small_strain_stiffness", "end_taper"])
TOLERANCE = 1e-10


def muscle_table(path: Path) -> Table:
    """Largest errors, in percent of the largest force."""
    table = read_table(path, ISOMETRIC).table
    lengths = sorted(table["elongation_mm"].unique())
    out = Table(
        "model", "all rows", *(f"{x:g} mm left out" for x in lengths), title="Largest error, % of the largest force"
    )
    for effects in MODELS:
        out.add_row(" + ".join(["continuum", *effects]), *_physics(table, effects, lengths))
    out.add_row("cubic in length and pressure", *_cubic(table, lengths))
    out.add_row("published, five coefficients", f"< {PUBLISHED}", *["–"] * len(lengths))
    return out


def _physics(table: pd.DataFrame, effects: Sequence[str], lengths: Sequence[float]) -> list[str]:
    rows = Rows.from_table(table)
    largest = float(rows.readings.value[:, 0].abs().max())
    model = build_model("continuum", effects=effects)
    vector = _fit(model, rows, starts(model, rows, 1, torch.Generator())[0])
    shown = [_error(model, rows) / largest]
    for length in lengths:
        inside = torch.tensor((table["elongation_mm"] != length).to_numpy())
        _fit(model, rows[inside], vector)
        shown.append(_error(model, rows[~inside]) / largest)
    return [f"{100 * error:.2f}" for error in shown]


def _fit(model: Model, rows: Rows, start: torch.Tensor) -> torch.Tensor:
    problem, (lower, upper) = Problem(model, rows), model.raw_bounds()
    solver = LevenbergMarquardt(
        problem.residuals, problem.jacobians, lower=lower, upper=upper,
        gtol=TOLERANCE, ftol=TOLERANCE, xtol=TOLERANCE, max_iterations=200, batched=True,
    )  # fmt: skip
    vector: torch.Tensor = solver.solve(start[None]).member(0).x
    model.set_vector(vector)
    return vector


def _error(model: Model, rows: Rows) -> float:
    with torch.no_grad():
        return float(rows.readings.missed(model(rows.states).loads)[:, 0].abs().max())


def _cubic(table: pd.DataFrame, lengths: Sequence[float]) -> list[str]:
    """The rows that pull alone: a polynomial knows no slack."""
    taut = table[table["slack"] == 0]
    length, pressure = taut["elongation_mm"].to_numpy() / 40, taut["pressure_kpa"].to_numpy() / 400
    columns = np.stack([length**i * pressure**j for i in range(4) for j in range(4 - i)], axis=1)
    force = taut["force_n"].to_numpy()

    def largest(fitted: np.ndarray, shown: np.ndarray) -> str:
        if not shown.any():
            return "–"
        slope = np.linalg.lstsq(columns[fitted], force[fitted], rcond=None)[0]
        return f"{100 * np.abs(columns[shown] @ slope - force[shown]).max() / np.abs(force).max():.2f}"

    every = np.ones(len(taut), dtype=bool)
    left_out = [(taut["elongation_mm"] == x).to_numpy() for x in lengths]
    return [largest(every, every), *(largest(~out, out) for out in left_out)]
