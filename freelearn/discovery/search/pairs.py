"""What every two effects would add together to a hypothesis: to first order, before any of it is fitted."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from freelearn.discovery.noise.linear_algebra import RIDGE, bounded_least_squares


@dataclass(frozen=True)
class Pair:
    """Two effects and what both together would add to the evidence. moved: by how much each raw parameter moves, the
    fit's own among them, by label."""

    names: tuple[str, str]
    evidence: float
    moved: dict[str, float]


@dataclass(frozen=True)
class Pairs:
    """Effects with k coefficients in all, linearized where they do nothing.

    places: of each effect its coefficients. odds: the logarithm of how probable each effect is beforehand. labels, own:
    of the coefficients and of the fit's p parameters; given (p, k): by how much each of these gives way to each of
    those. gram (k, k), slope (k,): products of their whitened derivatives, cleared of what the fit absorbs, with each
    other and with the residuals. low, high (k,), prior (k, k): bounds of the coefficients, and their covariance
    beforehand."""

    places: dict[str, slice]
    odds: dict[str, float]
    labels: tuple[str, ...]
    own: tuple[str, ...]
    given: np.ndarray
    gram: np.ndarray
    slope: np.ndarray
    low: np.ndarray
    high: np.ndarray
    prior: np.ndarray

    def best(self, most: int, without: Collection[str] = ()) -> list[Pair]:
        """The most promising pairs, the best first. without: effects that are in none."""
        found: list[Pair] = []
        # Bounds only lower what a pair adds: those that cannot be among the best need not be asked about theirs.
        for names, most_added in self._unbounded(without):
            if len(found) >= most and most_added < found[-1].evidence:
                break
            found = sorted([*found, self._bounded(names)], key=lambda pair: -pair.evidence)[:most]
        return found

    def _bounded(self, names: tuple[str, str]) -> Pair:
        places = np.concatenate([np.arange(len(self.slope))[self.places[name]] for name in names])
        gram, prior = (matrix[np.ix_(places, places)] for matrix in (self.gram, self.prior))
        added, step = linear_evidence(gram, self.slope[places], self.low[places], self.high[places], prior)
        moved = dict(zip(self.own, -self.given[:, places] @ step, strict=True))
        moved |= {self.labels[place]: size for place, size in zip(places, step, strict=True)}
        return Pair(names, added + sum(self.odds[name] for name in names), moved)

    def _unbounded(self, without: Collection[str]) -> list[tuple[tuple[str, str], float]]:
        """All pairs and what each would add if no parameter had a bound, the best first: all at once, each effect's
        matrices made as large as the largest by an unknown that changes nothing."""
        names = [name for name in self.places if name not in without]
        if len(names) < 2:
            return []
        nothing = len(self.slope)
        slope = np.append(self.slope, 0.0)
        gram, prior = block_diag(self.gram, 0.0), block_diag(self.prior, 1.0)
        sizes = [self.places[name].stop - self.places[name].start for name in names]
        own = np.full((len(names), max(sizes)), nothing)
        for number, (name, size) in enumerate(zip(names, sizes, strict=True)):
            own[number, :size] = np.arange(nothing)[self.places[name]]
        one, other = np.triu_indices(len(names), 1)
        places = np.hstack([own[one], own[other]])
        across, down = places[:, :, None], places[:, None, :]
        # The unknown that changes nothing stands there several times, each time for itself.
        apart = (across == nothing) & (np.arange(places.shape[1])[:, None] != np.arange(places.shape[1]))
        gram, prior, slope = gram[across, down], np.where(apart, 0.0, prior[across, down]), slope[across]
        root = np.linalg.cholesky(prior)
        inner, own_slope = _inner(gram, root), root.swapaxes(1, 2) @ slope
        gain = (own_slope * np.linalg.solve(inner, own_slope)).sum((1, 2))
        odds = np.array([self.odds[name] for name in names])
        added = 0.5 * gain - 0.5 * np.linalg.slogdet(inner)[1] + odds[one] + odds[other]
        return [((names[one[k]], names[other[k]]), float(added[k])) for k in np.argsort(-added, kind="stable")]


def linear_evidence(
    gram: np.ndarray, slope: np.ndarray, low: np.ndarray, high: np.ndarray, covariance: np.ndarray
) -> tuple[float, np.ndarray]:
    """Rise of the log-probability by a bounded step of k coefficients with a prior, and that step (k,)."""
    precision = np.linalg.inv(covariance)
    steps, gains = bounded_least_squares(gram + precision, slope[None], low, high)
    return 0.5 * float(gains[0]) - 0.5 * float(_occam(gram, covariance)), steps[0]


def _occam(gram: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Twice the logarithm of how much wider the prior is than what the rows leave of it: matrices (…, k, k) → (…)."""
    return np.asarray(np.linalg.slogdet(_inner(gram, np.linalg.cholesky(covariance)))[1])


def _inner(gram: np.ndarray, root: np.ndarray) -> np.ndarray:
    """1 + Lᵀ G L, of priors' roots L and matrices G, (…, k, k) each: positive definite, if only just where two effects
    do the same and 1 is below the last digit of what they do."""
    one, known = np.eye(gram.shape[-1]), root.swapaxes(-1, -2) @ gram @ root
    return np.asarray(known * (1 + RIDGE * one) + one)
