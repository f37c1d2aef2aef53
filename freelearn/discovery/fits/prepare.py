"""What a search is asked, the model before anything is added, and a step's model with one effect less."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from torch import Tensor

from freelearn.data.accuracy import Accuracy
from freelearn.data.bed_accuracy import changed
from freelearn.data.error import load_scale, usual_scale
from freelearn.data.rows import Rows
from freelearn.discovery.fits.derivatives import Build
from freelearn.discovery.fits.left_out import HeldOut, folds_of, held_out
from freelearn.discovery.fits.step import Step
from freelearn.discovery.fits.visits import joined_visits
from freelearn.discovery.fits.white_fit import WhiteFit, evaluated, white_fit
from freelearn.discovery.noise.noise import Noise, Whitener, relative_error, sensitivities
from freelearn.discovery.noise.scatter import Scatter, huber, scatter
from freelearn.discovery.thresholds import BOUNDED, WHITENINGS
from freelearn.fitting.starts import starts
from freelearn.physics.chain.history import settled_flicker
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Prior
from freelearn.physics.chain.prediction import Status
from freelearn.physics.chain.priors import RawPrior, raw_prior, spans

# What a search is asked.


@dataclass(frozen=True)
class Question:
    """Which of the candidates does the model miss on these rows?

    build: effect names → fresh model with these effects. candidates: names of the effects to try. accuracy: of the
    measuring. given: effects that the model has from the start: they are part of the question, and so are never taken
    out, exchanged or reported as missing. priors: the user's own, by the parameter's label. clocked: whether the rows
    tell when they were measured: nothing is sought in the time of rows that do not. unshown: effects that may act in
    these rows and are tried, but never claimed, because the rows cannot show them; and what that would need.
    """

    build: Callable[[Sequence[str]], Model]
    candidates: Sequence[str]
    rows: Rows
    accuracy: Accuracy
    seed: int
    given: Sequence[str] = ()
    priors: Mapping[str, Prior] = field(default_factory=dict)
    clocked: bool = True
    unshown: Mapping[str, str] = field(default_factory=dict)

    def added(self, effects: Sequence[str]) -> list[str]:
        """Those of a model's effects that were not given."""
        return [effect for effect in effects if effect not in self.given]

    def on(self, effects: Sequence[str]) -> Build:
        """What builds the model that has these effects, and more."""
        return lambda more: self.build([*effects, *more])

    def prior(self, model: Model, spans: Mapping[str, float]) -> RawPrior:
        """What is known of a model's raw vector."""
        return raw_prior(model, spans, self.priors)


# The model before anything is added: which rows have an answer, and how noisy each is.

# Errors of the first fits, as a share of the largest loads: what is known of the parameters beforehand weighs against
# rows that are off by that.
FIRST = 0.03


@dataclass(frozen=True)
class Prepared:
    """A question whose rows are settled.

    rows: those with an answer from the first model; kept: which of the question's rows these are, (N,) bool. scale:
    largest loads (2,), which the error is normalized by. fold: held-out share of every row, (n,). spans: see
    priors.
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
        slipped = whiten.slipped if slipped is None else slipped
        names = [effect.name for effect in fit.model.effects]
        effects = [*(name for name in names if name in self.question.given), *self.question.added(names)]
        return Step(
            effects, fit, whiten, found, self.rows.states, self.error(fit.raw_residual, slipped),
            self.error(found.raw, slipped), self._new_sample(fit, whiten, slipped), whiten.floor(self.scale),
            self._by_state(found.raw, slipped),
        )  # fmt: skip

    def _new_sample(self, fit: WhiteFit, whiten: Whitener, slipped: Tensor | None) -> float | None:
        sample = self.rows.states.sample.numpy()
        count = len(np.unique(sample))
        if count < 2 or any(p.per_sample for p in fit.model.declared.values()):
            return None
        found: HeldOut = held_out(fit, self.rows, whiten, folds_of(sample, self.question.seed, count), sample)
        return self.error(found.raw, slipped)

    def _by_state(self, raw: Tensor, slipped: Tensor | None) -> np.ndarray:
        """What each state adds to the square of that error, (states,)."""
        counted = self._counted(slipped)
        share = (raw / self.scale).square().masked_fill(~counted, 0.0) / counted.sum(0).clamp_min(1)
        return np.bincount(self.rows.state, weights=share.sum(-1).numpy())

    def error(self, raw: Tensor, slipped: Tensor | None = None) -> float:
        """The paper's E of residuals (N, 2), a fraction, without readings that slipped."""
        return relative_error((raw / self.scale).square(), self._counted(slipped))

    def _counted(self, slipped: Tensor | None) -> Tensor:
        """Readings that count, (N, 2) bool."""
        present = self.rows.readings.present
        return present if slipped is None else present & ~slipped


def prepare(question: Question) -> tuple[Prepared, WhiteFit, Noise]:
    """Fits the model with the given effects, which settles the rows, and their noise, in a few rounds."""
    model, rows = question.build(list(question.given)), question.rows.told()
    model.prepare(rows)
    known = spans(rows)
    prior = question.prior(model, known)
    start = starts(model, rows, 1, torch.Generator().manual_seed(question.seed))[0]
    kept = torch.ones(len(rows), dtype=torch.bool)
    fit = _first_fit(model, rows, start, prior)
    if rows.states.recording is not None:
        rows = replace(rows, states=settled_flicker(model, rows.states, model.physical(fit.vector)))
        fit = evaluated(model, rows, fit.vector)
    every = rows = joined_visits(fit, rows)
    noise: Noise | None = None
    for _ in range(WHITENINGS):
        with torch.no_grad():
            answered = fit.model(every.states).status == Status.OK
        if int(answered.sum()) > 2 * len(fit.vector) and not torch.equal(answered, kept):
            rows, kept, noise = every[torch.nonzero(answered)[:, 0]], answered, None
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
        bounded = huber(fit.raw_residual, even, power, rows.states, rows.readings.informative_mask(fit.shown))
        whiten = Whitener(still, state, even, bounded, bed, present)
        fit = white_fit(model, rows, whiten, fit.vector, prior, near=fit.near)
    return fit


def noise_about(fit: WhiteFit, rows: Rows, accuracy: Accuracy, before: Scatter | None = None) -> Noise:
    """What the measuring does to the rows of a fit, and the scatter about it. before: to go on from."""
    sensitivity, state, informative = (
        sensitivities(fit.model, rows.states),
        torch.as_tensor(rows.state),
        rows.readings.informative_mask(fit.shown),
    )
    if rows.readings.count <= len(fit.vector):
        # As stated: the fit leaves nothing that could say otherwise.
        return Noise(
            rows, accuracy, sensitivity, informative, huber(fit.raw_residual, accuracy, 1, rows.states, informative)
        )
    found = scatter(
        fit.raw_residual, fit.raw_jacobian, fit.shown, sensitivity, rows.states, state, accuracy, before, rows.readings
    )
    return Noise(rows, accuracy, sensitivity, informative, found)


def without(prepared: Prepared, step: Step, effect: str) -> Step | None:
    """The step refitted without one effect; None when that does not end in a minimum."""
    fit = fit_without(prepared, step, effect)
    return prepared.step(fit, step.whiten) if fit else None


def fit_without(prepared: Prepared, step: Step, effect: str) -> WhiteFit | None:
    """The same, its model alone, with no errors on what is left out."""
    question = prepared.question
    model = question.build([e for e in step.effects if e != effect])
    known = dict(zip(step.fit.model.labels(), step.fit.vector, strict=True))
    start = torch.stack([known[label] for label in model.labels()])
    fit = white_fit(model, prepared.rows, step.whiten, start, question.prior(model, prepared.spans))
    return fit if fit.proper else None
