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
from freelearn.discovery.search.pairs import Pairs, linear_evidence
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

    @cached_property
    def pairs(self) -> Pairs:
        """What every two of the effects promise."""
        own = tuple(self.fit.model.labels())
        if not self.parts:
            none, square = np.zeros(0), np.zeros((0, 0))
            return Pairs({}, {}, (), own, np.zeros((len(own), 0)), square, none, none, none, square)
        parts = self.parts.values()
        labels = tuple(label for part in parts for label in part.trial.labels)
        odds = {name: log_odds([name], self.odds) for name in self.parts}
        given = (self.inverse @ torch.cat([part.shared for part in parts], 1)).numpy()
        slope, low, high = (np.concatenate([getattr(p, n) for p in parts]) for n in ("slope", "low", "high"))
        prior = block_diag(*(part.prior for part in parts))
        return Pairs(self._places, odds, labels, own, given, self._products, slope, low, high, prior)

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
        known = self.gram, self.slope, self.low, self.high
        tried = [(*linear_evidence(*known, size**2 * self.covariance), size) for size in SIZES]
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


def signs(model: Model, label: str) -> tuple[float, float]:
    """Lower and upper bound, 0 or infinite, of the step by which the parameter may leave no effect."""
    p = model.declared[label]
    if p.log:
        return -math.inf, math.inf
    return (0.0 if p.none == p.lower else -math.inf), (0.0 if p.none == p.upper else math.inf)
