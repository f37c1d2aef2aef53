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
from freelearn.inference.scatter import Scatter, huber, scatter
from freelearn.inference.step import Step
from freelearn.inference.thresholds import BOUNDED, WHITENINGS
from freelearn.inference.units import units
from freelearn.inference.white_fit import WhiteFit, evaluated, white_fit
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.bed_accuracy import changed
from freelearn.measurements.error import load_scale, usual_scale
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

    def whitener(self, step: Step) -> Whitener:
        """Of the noise that the step's own stiffness implies, and of the scatter about its model."""
        return whitener(step.fit, self.rows, self.question.accuracy, step.whiten.scatter)

    def step(self, effects: list[str], fit: WhiteFit, whiten: Whitener) -> Step:
        """The step of a fitted model."""
        state = torch.unique(torch.as_tensor(self.rows.state), return_inverse=True)[1]
        heldout = cross_validate(fit, self.fold, units(state, int(state.max()) + 1)[0].numpy())
        step = Step(effects, fit, whiten, heldout, self.rows.states, 0.0, 0.0, None, whiten.floor(self.scale))
        return self.judged(step, whiten.scatter.slipped if whiten.scatter else None)

    def judged(self, step: Step, slipped: Tensor | None) -> Step:
        """The step with its errors on all readings but those that slipped, (N, 2) bool."""
        within, outside = (self._error(raw, slipped) for raw in (step.fit.raw_residual, step.heldout.raw))
        return step.with_errors(within, outside, self._new_sample(step.fit, slipped))

    def _new_sample(self, fit: WhiteFit, slipped: Tensor | None) -> float | None:
        sample = self.rows.states.sample.numpy()
        count = len(np.unique(sample))
        if count < 2 or any(p.per_sample for p in fit.model.declared.values()):
            return None
        return self._error(cross_validate(fit, folds_of(sample, self.question.seed, count), sample).raw, slipped)

    def _error(self, raw: Tensor, slipped: Tensor | None) -> float:
        squares = (raw / self.scale).square()
        present = self.rows.readings.present
        right = (present if slipped is None else present & ~slipped).double()
        return float(((squares * right).sum(0) / right.sum(0).clamp_min(1)).sum().sqrt())


def prepare(question: Question) -> tuple[Prepared, Step]:
    """Fits the model with the given effects, which settles the rows, and their whitening, in a few rounds."""
    model, rows = question.build(list(question.given)), question.rows
    model.prepare(rows)
    start = starts(model, rows, 1, torch.Generator().manual_seed(question.seed))[0]
    kept = torch.ones(len(rows), dtype=torch.bool)
    fit = _first_fit(model, rows, start)
    found: Scatter | None = None
    for _ in range(WHITENINGS):
        with torch.no_grad():
            answered = fit.model(question.rows.states).status == Status.OK
        if int(answered.sum()) > 2 * len(fit.vector) and not torch.equal(answered, kept):
            rows, kept, found = question.rows[torch.nonzero(answered)[:, 0]], answered, None
            fit = evaluated(fit.model, rows, fit.vector)
        whiten = whitener(fit, rows, question.accuracy, found)
        found = whiten.scatter
        fit = white_fit(model, rows, whiten, fit.vector)
    assert found is not None
    scale = load_scale(torch.where(found.slipped, 0.0, rows.loads))
    prepared = Prepared(question, rows, kept.numpy(), scale, folds_of(rows.state, question.seed))
    return prepared, prepared.step(list(question.given), fit, whiten)


def _first_fit(model: Model, rows: Rows, start: Tensor) -> WhiteFit:
    """Noise in proportion to the largest loads: the paper's error, for a first look. No reading has more than bounded
    influence, and the largest loads are those below which nearly all are: some may have slipped."""
    bed, present = rows.states.bed, rows.readings.present
    even = changed(Accuracy(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), bed, usual_scale(rows.readings), torch.zeros(2))
    still, state = torch.zeros(len(rows), 2, 3, dtype=torch.float64), torch.as_tensor(rows.state)
    fit = evaluated(model, rows, start)
    for power in BOUNDED:
        bounded = huber(fit.raw_residual, even, power, rows.states, rows.readings.felt(fit.shown))
        fit = white_fit(model, rows, Whitener(still, state, even, bounded, bed, present), fit.vector)
    return fit


def whitener(fit: WhiteFit, rows: Rows, accuracy: Accuracy, before: Scatter | None = None) -> Whitener:
    """Of the noise that the model's own stiffness implies, and of the scatter about it."""
    sensitivity, state = sensitivities(fit.model, rows.states), torch.as_tensor(rows.state)
    found = scatter(
        fit.raw_residual, fit.raw_jacobian, fit.shown, sensitivity, rows.states, state, accuracy, before, rows.readings
    )
    readings = rows.readings
    return Whitener(sensitivity, state, accuracy, found, rows.states.bed, readings.present, readings.felt(fit.shown))
