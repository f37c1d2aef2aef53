"""The model before anything is added: which rows have an answer, and how noisy each is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from freelearn.fitting.starts import starts
from freelearn.inference.left_out import HeldOut, folds_of, held_out
from freelearn.inference.noise import Noise, Whitener, sensitivities
from freelearn.inference.question import Question
from freelearn.inference.scatter import Scatter, huber, scatter
from freelearn.inference.step import Step
from freelearn.inference.thresholds import BOUNDED, WHITENINGS
from freelearn.inference.white_fit import WhiteFit, evaluated, white_fit
from freelearn.measurements.accuracy import Accuracy
from freelearn.measurements.bed_accuracy import changed
from freelearn.measurements.error import load_scale, usual_scale
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model
from freelearn.models.prediction import Status
from freelearn.models.priors import RawPrior, spans

# Errors of the first fits, as a share of the largest loads: what is known of the parameters beforehand weighs against
# rows that are off by that.
FIRST = 0.03


@dataclass(frozen=True)
class Prepared:
    """A question whose rows are settled.

    rows: those with an answer from the first model; kept: which of the question's rows these are, (N,) bool. scale:
    largest loads (2,), which the error is normalized by. fold: held-out share of every row, (n,). spans: see
    models.priors.
    """

    question: Question
    rows: Rows
    kept: np.ndarray
    scale: Tensor
    fold: np.ndarray
    spans: dict[str, float]

    def noise(self, fit: WhiteFit, before: Scatter | None = None) -> Noise:
        """That the fitted model's own stiffness implies, and the scatter about it. before: to go on from."""
        return noise_about(fit, self.rows, self.question.accuracy, before)

    def step(self, fit: WhiteFit, whiten: Whitener, slipped: Tensor | None = None) -> Step:
        """The step of a fitted model, with its errors on all readings but those that slipped, (N, 2) bool."""
        found = held_out(fit, self.rows, whiten, self.fold, self.rows.state)
        if slipped is None and whiten.scatter is not None:
            slipped = whiten.scatter.slipped
        names = [effect.name for effect in fit.model.effects]
        effects = [*(name for name in names if name in self.question.given), *self.question.added(names)]
        return Step(
            effects, fit, whiten, found, self.rows.states, self.error(fit.raw_residual, slipped),
            self.error(found.raw, slipped), self._new_sample(fit, whiten, slipped), whiten.floor(self.scale),
        )  # fmt: skip

    def _new_sample(self, fit: WhiteFit, whiten: Whitener, slipped: Tensor | None) -> float | None:
        sample = self.rows.states.sample.numpy()
        count = len(np.unique(sample))
        if count < 2 or any(p.per_sample for p in fit.model.declared.values()):
            return None
        found: HeldOut = held_out(fit, self.rows, whiten, folds_of(sample, self.question.seed, count), sample)
        return self.error(found.raw, slipped)

    def error(self, raw: Tensor, slipped: Tensor | None = None) -> float:
        """The paper's E of residuals (N, 2), a fraction, without readings that slipped."""
        squares = (raw / self.scale).square()
        present = self.rows.readings.present
        right = (present if slipped is None else present & ~slipped).double()
        return float(((squares * right).sum(0) / right.sum(0).clamp_min(1)).sum().sqrt())


def prepare(question: Question) -> tuple[Prepared, WhiteFit, Noise]:
    """Fits the model with the given effects, which settles the rows, and their noise, in a few rounds."""
    model, rows = question.build(list(question.given)), question.rows
    model.prepare(rows)
    known = spans(rows)
    prior = question.prior(model, known)
    start = starts(model, rows, 1, torch.Generator().manual_seed(question.seed))[0]
    kept = torch.ones(len(rows), dtype=torch.bool)
    fit = _first_fit(model, rows, start, prior)
    noise: Noise | None = None
    for _ in range(WHITENINGS):
        with torch.no_grad():
            answered = fit.model(question.rows.states).status == Status.OK
        if int(answered.sum()) > 2 * len(fit.vector) and not torch.equal(answered, kept):
            rows, kept, noise = question.rows[torch.nonzero(answered)[:, 0]], answered, None
            fit = evaluated(fit.model, rows, fit.vector)
        noise = noise_about(fit, rows, question.accuracy, None if noise is None else noise.scatter)
        fit = white_fit(model, rows, noise.whitener(), fit.vector, prior, near=fit.near)
    assert noise is not None
    scale = load_scale(torch.where(noise.scatter.slipped, 0.0, rows.loads))
    fold = folds_of(rows.state, question.seed)
    return Prepared(question, rows, kept.numpy(), scale, fold, known), fit, noise


def _first_fit(model: Model, rows: Rows, start: Tensor, prior: RawPrior) -> WhiteFit:
    """Noise in proportion to the largest loads: the paper's error, for a first look. No reading has more than bounded
    influence, and the largest loads are those below which nearly all are: some may have slipped."""
    bed, present = rows.states.bed, rows.readings.present
    even = changed(Accuracy(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), bed, FIRST * usual_scale(rows.readings), torch.zeros(2))
    still, state = torch.zeros(len(rows), 2, 3, dtype=torch.float64), torch.as_tensor(rows.state)
    fit = evaluated(model, rows, start)
    for power in BOUNDED:
        bounded = huber(fit.raw_residual, even, power, rows.states, rows.readings.felt(fit.shown))
        whiten = Whitener(still, state, even, bounded, bed, present)
        fit = white_fit(model, rows, whiten, fit.vector, prior, near=fit.near)
    return fit


def noise_about(fit: WhiteFit, rows: Rows, accuracy: Accuracy, before: Scatter | None = None) -> Noise:
    """What the measuring does to the rows of a fit, and the scatter about it. before: to go on from."""
    sensitivity, state, felt = (
        sensitivities(fit.model, rows.states),
        torch.as_tensor(rows.state),
        rows.readings.felt(fit.shown),
    )
    if rows.readings.count <= len(fit.vector):
        # As stated: the fit leaves nothing that could say otherwise.
        return Noise(rows, accuracy, sensitivity, felt, huber(fit.raw_residual, accuracy, 1, rows.states, felt))
    found = scatter(
        fit.raw_residual, fit.raw_jacobian, fit.shown, sensitivity, rows.states, state, accuracy, before, rows.readings
    )
    return Noise(rows, accuracy, sensitivity, felt, found)
