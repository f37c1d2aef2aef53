"""Errors of several models on all rows of a measured set, and on parts that were left out of the fit whole."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from questions import Question
from rich.table import Table
from sets import RealSet

from freelearn.data.rows import Rows
from freelearn.fitting.levenberg_marquardt import LevenbergMarquardt
from freelearn.fitting.problem import Problem
from freelearn.fitting.starts import starts
from freelearn.physics.chain.model import Model
from freelearn.physics.models.build import build_model

TOLERANCE, DEGREE = 1e-10, 3


def left_out_table(question: Question, chosen: RealSet, out: Path) -> Table:
    """One line a model, then a cubic polynomial, then what was published."""
    table = chosen.read(out)
    rows, parts = Rows.from_table(table), question.parts(table)
    names = sorted(set(parts), key=lambda words: [float(word) for word in words.split(", ")])
    unit = "% of the largest" if question.percent else " and ".join(name for _, name, _ in question.readings)
    kind = "largest error" if question.largest else "root mean square error"
    heads = ["all rows", *(f"{name} left out" for name in names), "all left out"]
    shown = Table("model", *heads, title=f"{question.recipe}: {kind}, {unit} (left out: {', '.join(question.groups)})")
    out_of_fit = [(parts == name).to_numpy(copy=True) for name in names]
    for effects in question.models:
        missed = _physics(rows, effects, out_of_fit)
        shown.add_row(" + ".join(["continuum", *effects]), *_told(question, rows, missed))
    missed = _cubic(table, rows, question.inputs, out_of_fit)
    shown.add_row(f"cubic in {', '.join(question.inputs)}", *_told(question, rows, missed))
    if question.published:
        shown.add_row(f"published: {question.published}")
    return shown


def _physics(rows: Rows, effects: Sequence[str], out: Sequence[np.ndarray]) -> list[torch.Tensor]:
    """What the fit to all rows misses (N, 2), then what fits without a part miss of it."""
    model = build_model("continuum", effects=effects)
    vector = fit(model, rows, starts(model, rows, 1, torch.Generator())[0])
    missed = [_missed(model, rows)]
    for part in out:
        fit(model, rows[torch.as_tensor(~part)], vector)
        missed.append(_missed(model, rows[torch.as_tensor(part)]))
    return missed


def fit(model: Model, rows: Rows, start: torch.Tensor) -> torch.Tensor:
    """The raw vector of least E from a start (p,); the model keeps it."""
    problem, (lower, upper) = Problem(model, rows), model.raw_bounds()
    solver = LevenbergMarquardt(
        problem.residuals, problem.jacobians, lower=lower, upper=upper,
        gtol=TOLERANCE, ftol=TOLERANCE, xtol=TOLERANCE, max_iterations=200, batched=True,
    )  # fmt: skip
    vector: torch.Tensor = solver.solve(start[None]).member(0).x
    model.set_vector(vector)
    return vector


def _missed(model: Model, rows: Rows) -> torch.Tensor:
    with torch.no_grad():
        missed = rows.readings.missed(model(rows.states).loads)
    return torch.where(rows.readings.present, missed, torch.nan)


def _cubic(table: pd.DataFrame, rows: Rows, inputs: Sequence[str], out: Sequence[np.ndarray]) -> list[torch.Tensor]:
    """The same of a full cubic in the inputs, fitted to the rows that pull: a polynomial knows no slack."""
    x = table[list(inputs)].to_numpy(float)
    x = (x - x.mean(0)) / np.maximum(x.std(0), 1e-12)
    powers = [p for p in np.ndindex(*[DEGREE + 1] * len(inputs)) if sum(p) <= DEGREE]
    columns = np.stack([np.prod(x ** np.array(p), axis=1) for p in powers], axis=1)
    readings, taut = rows.readings, ~rows.readings.slack.numpy()

    def missed(fitted: np.ndarray, shown: np.ndarray) -> torch.Tensor:
        errors = np.full((int(shown.sum()), 2), np.nan)
        for channel in (0, 1):
            there = readings.present[:, channel].numpy() & taut
            if not (there & fitted).any():
                continue
            value = readings.value[:, channel].numpy()
            slope = np.linalg.lstsq(columns[there & fitted], value[there & fitted], rcond=1e-9)[0]
            errors[:, channel] = np.where(there[shown], (columns @ slope - value)[shown], np.nan)
        return torch.as_tensor(errors)

    every = np.ones(len(table), dtype=bool)
    return [missed(every, every), *(missed(~part, part) for part in out)]


def _told(question: Question, rows: Rows, missed: Sequence[torch.Tensor]) -> list[str]:
    """One cell for all rows, for each part, and for all parts together."""
    largest = rows.readings.value.abs().amax(0)
    cells = []
    for errors in [*missed, torch.cat(list(missed[1:]))]:
        words = []
        for channel, _, factor in question.readings:
            there = errors[:, channel][errors[:, channel].isfinite()].abs()
            size = there.max() if question.largest and len(there) else there.square().mean().sqrt()
            share = 100 / largest[channel] if question.percent else factor
            words.append(f"{float(size * share):.2f}" if len(there) else "–")
        cells.append(" / ".join(words))
    return cells
