"""How strongly the residuals of a fit ask for each effect, before any of them is fitted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from freelearn.inference.bounded import bounded_least_squares
from freelearn.inference.derivatives import Build, Trial, trials
from freelearn.inference.linear_algebra import SMALLEST, normal_inverse, norms, orthonormal, summed_products
from freelearn.inference.noise import Whitener
from freelearn.inference.units import units
from freelearn.inference.white_fit import WhiteFit
from freelearn.measurements.rows import Rows
from freelearn.models.base import Model

# Sign patterns of the wild bootstrap.
DRAWS = 999
# An effect of which refitting the base parameters leaves less than this share cannot be seen in these data.
ABSORBED = 1e-4


@dataclass(frozen=True)
class EffectScore:
    """What the linearized effect promises.

    status: tested, not_testable or failed, the latter two with a reason. gain: reduction of χ² that it promises, and
    evidence the same as a normal deviate, see `evidence`. p_value: chance that the most promising of all effects would
    promise as much if there were nothing to find. start: raw parameters (p,) of the model with the effect, from which a
    full fit sets out; still: those at which the effect does nothing. signature: its whitened derivatives, cleared of
    what the model absorbs, (2N, k). low, high: bounds of their coefficients, (k,).
    """

    effect: str
    status: str = "tested"
    reason: str = ""
    gain: float = 0.0
    evidence: float = -math.inf
    p_value: float = 1.0
    start: Tensor | None = None
    still: Tensor | None = None
    signature: Tensor | None = None
    low: np.ndarray | None = None
    high: np.ndarray | None = None


# A score, and its evidence in each draw of the bootstrap; None where it could not be tested.
Drawn = tuple[EffectScore, np.ndarray | None]


def score_effects(
    fit: WhiteFit, rows: Rows, whiten: Whitener, names: Sequence[str], build: Build, variance: float, seed: int
) -> list[EffectScore]:
    """Scores every named effect at the fit. variance: of the whitened noise, from `structure`.

    Rao's score test: with C the effect's whitened derivative at no effect, cleared of what the fit's own parameters can
    absorb, the promised reduction is that of regressing the residuals on C, under the bounds that hold at no effect.
    Significance is that of the largest over the whole library, by a wild bootstrap that flips the signs of whole
    kinematic states (Cameron, Gelbach & Miller 2008), so it holds with noise shared by a state's rows and with misfit;
    each draw solves the same bounded problem as the residuals themselves. Of few states see `units`.
    """
    view = _View(fit, whiten, variance, seed)
    drawn: dict[str, Drawn] = {}
    for trial in trials(fit, rows, whiten, names, build):
        drawn[trial.effect] = _better(drawn.get(trial.effect), view.score(trial))
    nulls = [null for _, null in drawn.values() if null is not None]
    if not nulls:
        return [score for score, _ in drawn.values()]
    largest = np.max(nulls, axis=0)
    return [
        score if null is None else replace(score, p_value=float((1 + (largest >= score.evidence).sum()) / (DRAWS + 1)))
        for score, null in drawn.values()
    ]


def evidence(gain: np.ndarray, degrees: int) -> np.ndarray:
    """A reduction of χ² as a normal deviate: puts effects of one and of several parameters on one scale.

    Wilson & Hilferty's (1931) cube root, which neither saturates nor underflows where a p-value would.

    >>> evidence(np.array([0.7, 3.84, 6.63]), 1).round(1)
    array([0.2, 1.7, 2.3])
    """
    share = 2 / (9 * degrees)
    deviate: np.ndarray = (np.cbrt(np.maximum(gain, 0) / degrees) - (1 - share)) / share**0.5
    return deviate


def _better(one: Drawn | None, other: Drawn) -> Drawn:
    """The more telling of two grid values of one effect; chance has as many tries."""
    if one is None or (one[1] is None and other[1] is not None):
        return other
    if other[1] is None:
        return one
    assert one[1] is not None
    null = np.maximum(one[1], other[1])
    return (other[0] if other[0].evidence > one[0].evidence else one[0]), null


class _View:
    """The fit that effects are scored at: its residuals, what it absorbs, and the bootstrap's signs."""

    def __init__(self, fit: WhiteFit, whiten: Whitener, variance: float, seed: int) -> None:
        self.fit, self.whiten, self.variance = fit, whiten, variance
        self.flat, self.jacobian = fit.residual.reshape(-1), fit.jacobian.flatten(0, 1)
        self.absorbed, self.inverse = orthonormal(self.jacobian), normal_inverse(self.jacobian)
        self.unit, self.units = units(whiten.state, whiten.states)
        generator = np.random.default_rng([seed, 7])
        self.signs = torch.as_tensor(generator.choice([-1.0, 1.0], size=(DRAWS, self.units)))

    def score(self, trial: Trial) -> Drawn:
        if not bool(trial.columns.isfinite().all()):
            return EffectScore(trial.effect, "failed", "its derivative at no effect is not finite"), None
        length = norms(trial.columns)
        if bool((length == 0).all()):
            return EffectScore(trial.effect, "not_testable", "it changes no load of these rows"), None
        unit = trial.columns / length.clamp_min(SMALLEST)
        cleared = unit - self.absorbed @ (self.absorbed.T @ unit)
        cleared = cleared - self.absorbed @ (self.absorbed.T @ cleared)
        seen = norms(cleared) > ABSORBED
        if not bool(seen.any()):
            reason = "refitting the model's own parameters absorbs it in these rows"
            return EffectScore(trial.effect, "not_testable", reason), None
        signature = cleared[:, seen]
        labels = [label for label, s in zip(trial.labels, seen.tolist(), strict=True) if s]
        low, high = np.array([signs(trial.model, label) for label in labels]).T
        each = summed_products(signature, self.flat, self.unit, self.units)
        slopes = torch.cat([each.sum(0)[None], self.signs @ each]).neg().numpy()
        # Columns are of length one before clearing: a sum of several that the fit absorbs is not followed either.
        gram = signature.T @ signature + ABSORBED**2 * torch.eye(len(labels), dtype=signature.dtype)
        steps, gains = bounded_least_squares(gram.numpy(), slopes, low, high)
        deviates = evidence(gains / self.variance, len(labels))
        start = self._start(trial, labels, seen, torch.as_tensor(steps[0]) / length[seen])
        score = EffectScore(
            trial.effect,
            gain=float(gains[0]),
            evidence=float(deviates[0]),
            start=start,
            still=trial.vector,
            signature=signature,
            low=low,
            high=high,
        )
        return score, deviates[1:]

    def _start(self, trial: Trial, labels: Sequence[str], seen: Tensor, moved: Tensor) -> Tensor:
        """Raw vector with the effect moved, to which the fit's own parameters give way to first order."""
        place = {label: i for i, label in enumerate(trial.model.labels())}
        start = trial.vector.clone()
        start[[place[label] for label in labels]] += moved
        change = trial.columns[:, seen] @ moved
        start[[place[label] for label in self.fit.model.labels()]] -= self.inverse @ (self.jacobian.T @ change)
        return start.clamp(*trial.model.raw_bounds())


def signs(model: Model, label: str) -> tuple[float, float]:
    """Lower and upper bound, 0 or infinite, of the step by which the parameter may leave no effect."""
    p = model.declared[label]
    if p.log:
        return -math.inf, math.inf
    return (0.0 if p.none == p.lower else -math.inf), (0.0 if p.none == p.upper else math.inf)
