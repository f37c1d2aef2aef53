"""What each effect, and each pair, would add to a hypothesis: to first order, before any of it is fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import torch
from scipy.linalg import block_diag
from scipy.special import chdtrc
from torch import Tensor

from freelearn.data.rows import Rows
from freelearn.discovery.fits.derivatives import Build, Trial, trials
from freelearn.discovery.fits.white_fit import WhiteFit
from freelearn.discovery.noise.linear_algebra import bounded_least_squares
from freelearn.discovery.noise.noise import Whitener
from freelearn.discovery.search.hypothesis import SIZES, VAST, log_odds
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import Prior
from freelearn.physics.chain.priors import raw_prior

# An effect of which refitting the base parameters leaves less than this share of its length cannot be seen.
ABSORBED = 1e-4


@dataclass(frozen=True)
class Promise:
    """What an effect promises, linearized where it does nothing.

    status: tested, not_testable or failed, the latter two with a reason. chi2: the reduction of χ² alone, p_value the
    chance of as much from noise, times the effects tried. evidence: by how much the logarithm of the probability would
    rise, prior odds included. start, still: raw parameters (p,) of the model with the effect, from which a fit sets
    out, and at which the effect does nothing.
    """

    effect: str
    status: str = "tested"
    reason: str = ""
    chi2: float = 0.0
    p_value: float | None = None
    evidence: float = -math.inf
    start: Tensor | None = None
    still: Tensor | None = None


class Ranking:
    """The effects tried on a fit, and what they promise alone and in twos.

    build: the fit's model with these effects more. spans, given: as for priors.raw_prior. variance: of the whitened
    noise, for p-values. odds: of effects that are in no library."""

    def __init__(
        self, fit: WhiteFit, rows: Rows, whiten: Whitener, names: Sequence[str], build: Build,
        spans: Mapping[str, float], given: Mapping[str, Prior], odds: Mapping[str, float],
    ) -> None:  # fmt: skip
        assert fit.prior is not None
        self.fit, self.odds = fit, odds
        # A row without an answer tells nothing.
        jacobian = fit.jacobian.flatten(0, 1).nan_to_num(0.0, 0.0, 0.0)
        self.inverse, self.jacobian = fit.covariance(), jacobian
        residual = fit.residual.reshape(-1).nan_to_num(0.0, 0.0, 0.0)
        # What is left of the slope where bounds hold parameters back, and of their prior, is nothing's to explain.
        self.residual = residual
        self.parts: dict[str, _Part] = {}
        self.refused: dict[str, Promise] = {}
        for trial in trials(fit, rows, whiten, names, build, odds):
            made = self._part(trial, spans, given)
            if isinstance(made, Promise):
                self.refused.setdefault(trial.effect, made)
            elif trial.effect not in self.parts or made.evidence > self.parts[trial.effect].evidence:
                self.parts[trial.effect] = made
        for name in self.parts:
            self.refused.pop(name, None)

    def _part(self, trial: Trial, spans: Mapping[str, float], given: Mapping[str, Prior]) -> _Part | Promise:
        columns, model = trial.columns, trial.model
        if not bool(columns.isfinite().all()):
            return Promise(trial.effect, "failed", "its derivative at no effect is not finite")
        before = columns.square().sum(0)
        if bool((before == 0).all()):
            return Promise(trial.effect, "not_testable", "it changes no load of these rows")
        shared = self.jacobian.T @ columns
        gram = columns.T @ columns - shared.T @ self.inverse @ shared
        if bool((gram.diagonal() <= ABSORBED**2 * before).all()):
            return Promise(
                trial.effect, "not_testable", "refitting the model's own parameters absorbs it in these rows"
            )
        labels = model.labels()
        place = [labels.index(label) for label in trial.labels]
        covariance = raw_prior(model, spans, given).covariance[place][:, place].numpy()
        low, high = np.array([signs(model, label) for label in trial.labels]).T
        part = _Part(
            trial, columns, shared, gram.numpy(), -(columns.T @ self.residual).numpy(),
            np.where(np.isinf(covariance), VAST, covariance), low, high,
        )  # fmt: skip
        part.solve(log_odds([trial.effect], self.odds))
        return part

    def promises(self) -> list[Promise]:
        """Of every effect, the most promising first, then those that cannot be tested."""
        count = len(self.parts)
        told = []
        for name, part in self.parts.items():
            chi2 = float(bounded_least_squares(part.gram, part.slope[None], part.low, part.high)[1][0])
            chance = min(1.0, count * float(chdtrc(len(part.slope), max(chi2, 0.0))))
            start = self._start(part)
            told.append(Promise(name, "tested", "", chi2, chance, part.evidence, start, part.trial.vector))
        return [*sorted(told, key=lambda p: -p.evidence), *self.refused.values()]

    def pairs(self, most: int) -> list[tuple[tuple[str, str], float]]:
        """The most promising pairs, with what both together would add, the best first."""
        found: list[tuple[tuple[str, str], float]] = []
        # Bounds only lower what a pair adds: those that cannot be among the best need not be asked about theirs.
        for (one, other), most_added in self._unbounded():
            if len(found) >= most and most_added < found[-1][1]:
                break
            names = (one.trial.effect, other.trial.effect)
            slope, low, high = (np.concatenate([getattr(p, n) for p in (one, other)]) for n in ("slope", "low", "high"))
            gram, prior = self._gram(one, other), block_diag(one.prior, other.prior)
            added = _evidence(gram, slope, low, high, prior)[0] + log_odds(names, self.odds)
            found = sorted([*found, (names, added)], key=lambda pair: -pair[1])[:most]
        return found

    def _unbounded(self) -> list[tuple[tuple[_Part, _Part], float]]:
        """All pairs and what each would add if no parameter had a bound, the best first: all at once, each effect's
        matrices made as large as the largest by an unknown that changes nothing."""
        parts = list(self.parts.values())
        if len(parts) < 2:
            return []
        slope = np.concatenate([*(part.slope for part in parts), [0.0]])
        gram, covariance = block_diag(self._products, 0.0), block_diag(*(part.prior for part in parts), 1.0)
        own = np.full((len(parts), max(len(part.slope) for part in parts)), len(slope) - 1)
        for number, place in enumerate(self._places.values()):
            own[number, : place.stop - place.start] = np.arange(place.start, place.stop)
        one, other = np.triu_indices(len(parts), 1)
        places = np.hstack([own[one], own[other]])
        across, down = places[:, :, None], places[:, None, :]
        # The unknown that changes nothing stands there several times, each time for itself.
        apart = (across == len(slope) - 1) & (np.arange(places.shape[1])[:, None] != np.arange(places.shape[1]))
        gram, covariance, slope = gram[across, down], np.where(apart, 0.0, covariance[across, down]), slope[across]
        gain = (slope * np.linalg.solve(gram + np.linalg.inv(covariance), slope)).sum((1, 2))
        odds = np.array([log_odds([part.trial.effect], self.odds) for part in parts])
        added = 0.5 * gain - 0.5 * _occam(gram, covariance) + odds[one] + odds[other]
        return [((parts[one[k]], parts[other[k]]), float(added[k])) for k in np.argsort(-added, kind="stable")]

    def cosines(self) -> tuple[list[str], np.ndarray]:
        """The effects and the largest cosine between the traces of each two, (k, k): one for what cannot be told
        apart."""
        roots = {name: np.linalg.pinv(sqrtm(part.gram), rcond=1e-9) for name, part in self.parts.items()}
        names = list(self.parts)
        table = np.eye(len(names))
        for i, j in combinations(range(len(names)), 2):
            cross = self._cross(self.parts[names[i]], self.parts[names[j]])
            table[i, j] = table[j, i] = np.linalg.norm(roots[names[i]] @ cross @ roots[names[j]], 2)
        return names, table.clip(0, 1)

    @cached_property
    def _products(self) -> np.ndarray:
        """Products of all effects' columns, cleared of what the fit absorbs: those of one after the other's."""
        columns, shared = (torch.cat([getattr(p, n) for p in self.parts.values()], 1) for n in ("columns", "shared"))
        return np.asarray(columns.T @ columns - shared.T @ self.inverse @ shared)

    @cached_property
    def _places(self) -> dict[str, slice]:
        ends = np.cumsum([len(part.slope) for part in self.parts.values()])
        each = zip(self.parts.items(), ends, strict=True)
        return {name: slice(int(end) - len(part.slope), int(end)) for (name, part), end in each}

    def _cross(self, one: _Part, other: _Part) -> np.ndarray:
        """Products of two effects' columns, cleared of what the fit absorbs."""
        return self._products[self._places[one.trial.effect], self._places[other.trial.effect]]

    def _gram(self, one: _Part, other: _Part) -> np.ndarray:
        cross = self._cross(one, other)
        return np.block([[one.gram, cross], [cross.T, other.gram]])

    def _start(self, part: _Part) -> Tensor:
        """The raw vector with the effect moved, to which the fit's own parameters give way to first order."""
        model, moved = part.trial.model, torch.as_tensor(part.step)
        place = {label: i for i, label in enumerate(model.labels())}
        start = part.trial.vector.clone()
        start[[place[label] for label in part.trial.labels]] += moved
        start[[place[label] for label in self.fit.model.labels()]] -= self.inverse @ (part.shared @ moved)
        return start.clamp(*model.raw_bounds())


class _Part:
    """An effect's whitened derivatives, cleared of what the fit absorbs: columns (2N, k), their products with the fit's
    (p, k), with each other (k, k) and with the residuals (k,); bounds and prior covariance of their coefficients."""

    def __init__(
        self, trial: Trial, columns: Tensor, shared: Tensor, gram: np.ndarray, slope: np.ndarray,
        covariance: np.ndarray, low: np.ndarray, high: np.ndarray,
    ) -> None:  # fmt: skip
        self.trial, self.columns, self.shared = trial, columns, shared
        self.gram, self.slope, self.covariance, self.low, self.high = gram, slope, covariance, low, high
        self.evidence, self.size, self.step = -math.inf, 1.0, np.zeros_like(slope)

    def solve(self, odds: float) -> None:
        """The best of SIZES: evidence, size and step (k,)."""
        tried = [
            (*_evidence(self.gram, self.slope, self.low, self.high, size**2 * self.covariance), size) for size in SIZES
        ]
        best = max(tried, key=lambda t: t[0])
        mean = math.log(sum(math.exp(t[0] - best[0]) for t in tried) / len(tried))
        self.evidence, self.step, self.size = best[0] + mean + odds, best[1], best[2]

    @property
    def prior(self) -> np.ndarray:
        """Covariance (k, k) of the coefficients beforehand, of the best size."""
        return np.asarray(self.size**2 * self.covariance)


def sqrtm(gram: np.ndarray) -> np.ndarray:
    """The symmetric root of a positive semidefinite matrix (k, k)."""
    size, axes = np.linalg.eigh(gram)
    root: np.ndarray = axes * np.sqrt(size.clip(0)) @ axes.T
    return root


def _evidence(
    gram: np.ndarray, slope: np.ndarray, low: np.ndarray, high: np.ndarray, covariance: np.ndarray
) -> tuple[float, np.ndarray]:
    """Rise of the log-probability by a bounded step of k coefficients with a prior, and that step (k,)."""
    precision = np.linalg.inv(covariance)
    steps, gains = bounded_least_squares(gram + precision, slope[None], low, high)
    return 0.5 * float(gains[0]) - 0.5 * float(_occam(gram, covariance)), steps[0]


def _occam(gram: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Twice the logarithm of how much wider the prior is than what the rows leave of it: matrices (…, k, k) → (…)."""
    root = np.linalg.cholesky(covariance)
    inner = np.eye(gram.shape[-1]) + root.swapaxes(-1, -2) @ gram @ root
    return np.asarray(np.linalg.slogdet(inner)[1])


def signs(model: Model, label: str) -> tuple[float, float]:
    """Lower and upper bound, 0 or infinite, of the step by which the parameter may leave no effect."""
    p = model.declared[label]
    if p.log:
        return -math.inf, math.inf
    return (0.0 if p.none == p.lower else -math.inf), (0.0 if p.none == p.upper else math.inf)
