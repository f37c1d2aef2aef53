"""The model before anything is added: which rows have an answer, and how noisy each is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.fit.starts import starts
from freelearn.inference.crossval import cross_validate, folds_of
from freelearn.inference.noise import Whitener, sensitivities
from freelearn.inference.question import Question
from freelearn.inference.step import Step
from freelearn.inference.thresholds import WHITENINGS
from freelearn.inference.white_fit import WhiteFit, white_fit
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.error import load_scale
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model
from freelearn.models.prediction import Status


@dataclass(frozen=True)
class Prepared:
    """A question whose rows are settled.

    rows: those with an answer from the first model; kept: which of the question's rows these are, (N,) bool. scale:
    largest loads (2,), which the error is normalized by. fold: held-out share of every row, (n,).
    """

    question: Question
    rows: Rows
    kept: np.ndarray
    scale: Tensor
    fold: np.ndarray

    def whitener(self, model: Model) -> Whitener:
        """Of the noise that the model's own stiffness implies."""
        return _whitener(model, self.rows, self.question.accuracy)

    def step(self, effects: list[str], fit: WhiteFit, whiten: Whitener) -> Step:
        """The step of a fitted model."""
        heldout = cross_validate(fit, self.fold, self.rows.state)
        floor = float((whiten.variance / self.scale**2).sum(-1).mean().sqrt())
        within, outside = self._error(fit.raw_residual), self._error(heldout.raw)
        return Step(effects, fit, whiten, heldout, self.rows.states, within, outside, self._new_sample(fit), floor)

    def _new_sample(self, fit: WhiteFit) -> float | None:
        sample = self.rows.states.sample.numpy()
        count = len(np.unique(sample))
        if count < 2 or any(p.per_sample for p in fit.model.declared.values()):
            return None
        return self._error(cross_validate(fit, folds_of(sample, self.question.seed, count), sample).raw)

    def _error(self, raw: Tensor) -> float:
        return float((raw / self.scale).square().sum(-1).mean().sqrt())


def prepare(question: Question) -> tuple[Prepared, Step]:
    """Fits the model with the given effects, which settles the rows, and their whitening, in a few rounds."""
    model, rows = question.build(list(question.given)), question.rows
    scale = load_scale(rows.loads)
    model.prepare(rows.states, rows.loads)
    start = starts(model, rows.states, rows.loads, 1, torch.Generator().manual_seed(question.seed))[0]
    kept = torch.ones(len(rows), dtype=torch.bool)
    # Noise in proportion to the largest loads: the paper's error, for a first look.
    even = Accuracy(0.0, 0.0, 0.0, float(scale[0]), float(scale[1]))
    whiten = Whitener(torch.zeros(len(rows), 2, 3, dtype=torch.float64), torch.as_tensor(rows.state), even)
    fit = white_fit(model, rows, whiten, start)
    for _ in range(WHITENINGS):
        with torch.no_grad():
            answered = model(question.rows.states).status == Status.OK
        if int(answered.sum()) > 2 * len(fit.vector):
            kept = answered
        rows = question.rows[torch.nonzero(kept)[:, 0]]
        whiten = _whitener(model, rows, question.accuracy)
        fit = white_fit(model, rows, whiten, fit.vector)
    prepared = Prepared(question, rows, kept.numpy(), scale, folds_of(rows.state, question.seed))
    return prepared, prepared.step(list(question.given), fit, whiten)


def _whitener(model: Model, rows: Rows, accuracy: Accuracy) -> Whitener:
    return Whitener(sensitivities(model, rows.states), torch.as_tensor(rows.state), accuracy)
