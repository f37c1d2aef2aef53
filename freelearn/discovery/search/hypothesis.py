"""A set of effects that may be what a model lacks, with its fit, and how probable rows make it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.physics.chain.priors import RawPrior
from freelearn.physics.effects.registry import EFFECTS

Effects = frozenset[str]
Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class Hypothesis:
    """effects: those added to the question's own, in the order of the library. fit: at the most probable parameters.
    evidence: logarithm of its probability, up to a constant that all hypotheses under the same noise share."""

    effects: tuple[str, ...]
    fit: WhiteFit
    evidence: float

    @cached_property
    def key(self) -> Effects:
        """The effects, whatever their order."""
        return frozenset(self.effects)


# How probable rows make a set of effects: the evidence of its model, by Laplace's approximation.

# How large an effect is, where it is there at all, is known within decades only: so many times its prior's deviation,
# each as likely as the others.
SIZES = (1.0, 1 / 3, 1 / 10, 1 / 30)
# Variance of what nothing is known of.
VAST = 1e8


def log_odds(effects: Sequence[str], others: Mapping[str, float] | None = None) -> float:
    """Logarithm of the odds, before any row was looked at, that an actuator has these effects.

    others: odds of effects that are in no library."""
    odds = [(others or {}).get(name) or EFFECTS[name].odds for name in effects]
    return sum(math.log(p / (1 - p)) for p in odds)


def minimal(sets: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those of which no part is as probable: an effect more that makes a set less probable may predict a little
    better, by chance."""
    return [h for h in sets if not any(part.key < h.key and part.evidence >= h.evidence for part in sets)]


def log_evidence(fit: WhiteFit, effects: Sequence[str]) -> float:
    """Logarithm of the probability of the rows under the fit's model, up to a constant that all models of them share.

    The sum of squares is taken for quadratic about the most probable parameters (Laplace; MacKay 1992). The deviations
    of each effect's parameters are multiplied by each of SIZES, and those that are alike as often as not (Effect.alike)
    are taken for either; of all that the mean is taken, effect by effect in turn about the most probable ones. effects:
    those whose size is not known; the model may have more.
    """
    assert fit.prior is not None
    view = _Quadratic(fit)
    chosen: dict[str, _Guess] = {}
    best, spread, before = -math.inf, 0.0, None
    # Of several effects each one's best guess depends on the others'.
    while chosen != before:
        before, spread = dict(chosen), 0.0
        for name in effects:
            guesses = _guesses(name)
            each = np.array([view.evidence(chosen | {name: guess}) for guess in guesses])
            most = int(each.argmax())
            if name not in chosen or each[most] > best:
                chosen[name], best = guesses[most], float(each[most])
            spread += float(np.logaddexp.reduce(each - best)) - math.log(len(guesses))
    return (best if effects else view.evidence({})) + spread


class _Guess(NamedTuple):
    """What an effect's parameters may be like. size: their deviations, in those of their prior; one: whether those that
    may be alike are one number."""

    size: float
    one: bool


def _guesses(effect: str) -> list[_Guess]:
    either = (False, True) if effect in EFFECTS and EFFECTS[effect].alike else (False,)
    return [_Guess(size, one) for size in SIZES for one in either]


class _Quadratic:
    """A fit's sum of squares about its vector: |r + Js|² for a step s, of which J = QR sees |Qᵀr + Rs|²."""

    def __init__(self, fit: WhiteFit) -> None:
        basis, self.root = np.linalg.qr(fit.jacobian.flatten(0, 1).numpy())
        self.along = basis.T @ fit.residual.reshape(-1).numpy()
        self.beside = max(fit.chi2 - float(self.along @ self.along), 0.0)
        self.prior, self.labels = fit.prior, fit.model.labels()
        self.vector = fit.vector.numpy()
        self.low, self.high = (bound.numpy() for bound in fit.model.raw_bounds())
        self.sized = {name for name, p in fit.model.declared.items() if p.none is not None}

    def evidence(self, guesses: Mapping[str, _Guess]) -> float:
        """With what is guessed of some effects' parameters."""
        sizes = {name: guess.size for name, guess in guesses.items()}
        prior: RawPrior = self.prior.scaled(self.labels, sizes, self.sized)  # type: ignore[union-attr]
        for name, guess in guesses.items():
            if guess.one:
                prior = prior.tied(self.labels, [f"{name}.{parameter}" for parameter in EFFECTS[name].alike])
        covariance = prior.covariance.numpy()
        deviations = np.linalg.cholesky(np.where(np.isinf(covariance), VAST, covariance))
        held = np.linalg.inv(deviations)
        # Least squares, never their normal equations: of a model that ran away slopes differ by more than the root of
        # what a number holds, and a sum of squares came out far below zero.
        slopes = np.vstack([self.root, held])
        wanted = -np.concatenate([self.along, held @ (self.vector - prior.middle.numpy())])
        missed = np.square(slopes @ self._step(slopes, wanted) - wanted).sum()
        occam = np.log1p(np.square(np.linalg.svd(self.root @ deviations, compute_uv=False))).sum()
        return float(-0.5 * (self.beside + missed + occam))

    def _step(self, slopes: Array, wanted: Array) -> Array:
        """To the most probable vector between the bounds, (p,)."""
        size = np.linalg.norm(slopes, axis=0)
        step: Array = np.linalg.lstsq(slopes / size, wanted)[0] / size
        low, high = np.minimum(self.low - self.vector, 0.0), np.maximum(self.high - self.vector, 0.0)
        if np.all((step >= low) & (step <= high)):
            return step
        moves, step = high > low, np.zeros_like(step)
        bounds = ((low * size)[moves], (high * size)[moves])
        step[moves] = lsq_linear((slopes / size)[:, moves], wanted, bounds, method="bvls").x / size[moves]
        return step
