"""The distribution of one reading's error: Student's t, a share that slipped, and noise that grows with the load."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from scipy.special import gammaln, stdtrit
from torch import Tensor

# The distribution of one reading's error: Student's t about what was expected, and a small share that slipped.

# Degrees of freedom that are told apart; infinite is the normal distribution.
FREEDOMS = (3.0, 4.0, 5.0, 7.0, 10.0, 20.0, np.inf)
# Log-likelihood by which heavier tails must do better than normal ones: else bounding errors costs precision for
# nothing (Student's t with 3 degrees of freedom fits 100 normal errors worse by 3 and more).
TAILS_WORTH = 2.0
# A slipped reading may be anywhere: its displacement is spread evenly over so many standard deviations.
SPREAD = 1000.0
# Share of slipped readings before any is seen, as so many readings of all.
PRIOR = 0.5
# Largest share: what more readings than that have in common is not a slip.
MOST = 0.1
# A good reading is taken for a slipped one with this chance at most, and never below so many standard deviations.
FALSE, FEWEST_SIGMAS = 4e-4, 5.0


@dataclass(frozen=True)
class Tails:
    """freedom: degrees of freedom of Student's t, infinite for the normal distribution. slipped: share of readings that
    slipped. Errors are in units of the distribution's scale, which is its standard deviation only if it is normal."""

    freedom: float = np.inf
    slipped: float = 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of good readings, in units of the scale."""
        return float(np.sqrt(self.freedom / (self.freedom - 2))) if np.isfinite(self.freedom) else 1.0

    @property
    def efficiency(self) -> float:
        """Information of a reading, as a share of that of a normal one of the same scale: (ν + 1)/(ν + 3)."""
        return float((self.freedom + 1) / (self.freedom + 3)) if np.isfinite(self.freedom) else 1.0

    @property
    def limit(self) -> float:
        """Size beyond which a reading is pointed out, in units of the scale."""
        if not np.isfinite(self.freedom):
            return FEWEST_SIGMAS
        return float(max(FEWEST_SIGMAS * self.deviation, -stdtrit(self.freedom, FALSE / 2)))

    def log_density(self, z: np.ndarray) -> np.ndarray:
        """Logarithm of the density of good readings' errors z."""
        return log_density(z, self.freedom)

    def good(self, z: np.ndarray) -> np.ndarray:
        """Chance that a reading with the error z did not slip."""
        right = (1 - self.slipped) * np.exp(self.log_density(z))
        wrong = self.slipped / SPREAD
        chance: np.ndarray = right / np.maximum(right + wrong, 1e-300)
        return chance

    def weight(self, z: np.ndarray) -> np.ndarray:
        """Weight of a squared error z² in the likelihood: one for normal errors, bounded influence for others."""
        if not np.isfinite(self.freedom):
            return np.ones_like(z)
        weight: np.ndarray = (self.freedom + 1) / (self.freedom + z**2)
        return weight


def log_density(z: np.ndarray, freedom: float) -> np.ndarray:
    """Logarithm of the density of Student's t of scale one; the normal one for infinite freedom."""
    if not np.isfinite(freedom):
        normal: np.ndarray = -0.5 * z**2 - 0.5 * np.log(2 * np.pi)
        return normal
    constant = gammaln((freedom + 1) / 2) - gammaln(freedom / 2) - 0.5 * np.log(freedom * np.pi)
    student: np.ndarray = constant - (freedom + 1) / 2 * np.log1p(z**2 / freedom)
    return student


def fitted(z: np.ndarray, before: Tails) -> tuple[Tails, float]:
    """Tails of errors z in some unit by maximum likelihood, and the scale in that unit. before: of the last round."""
    found: dict[float, tuple[float, Tails, float]] = {}
    for freedom in FREEDOMS:
        tails, scale = replace(before, freedom=freedom, slipped=max(before.slipped, PRIOR / len(z))), 1.0
        for _ in range(30):
            good, weight = tails.good(z / scale), tails.weight(z / scale)
            moved = float(np.sqrt((good * weight * z**2).sum() / max(good.sum(), 1.0)))
            slipped = min((float((1 - good).sum()) + PRIOR) / (len(z) + 2 * PRIOR), MOST)
            done = abs(moved - scale) < 1e-4 * scale
            tails, scale = replace(tails, slipped=slipped), max(moved, 1e-9)
            if done:
                break
        right = (1 - tails.slipped) * np.exp(tails.log_density(z / scale)) / scale
        likelihood = float(np.log(right + tails.slipped / SPREAD).sum())
        found[freedom] = likelihood, tails, scale
    normal = found[np.inf]
    best = max(found.values(), key=lambda f: f[0])
    _, tails, scale = best if best[0] > normal[0] + TAILS_WORTH else normal
    return tails, scale


# Noise that grows with the load or with the pressure.

LOAD, PRESSURE = "load", "pressure"
# Increase of the standard deviation, from none to the largest load or pressure, that is told apart.
STEPS = (0.5, 1.0, 2.0, 4.0, 8.0)
# Log-likelihood by which growing noise must do better than even noise.
GROWTH_WORTH = 6.0


@dataclass(frozen=True)
class Growth:
    """Standard deviations grow in proportion to 1 + amount × (|load| or pressure) / its largest. kind: of which."""

    kind: str = ""
    amount: float = 0.0

    def factor(self, loads: Tensor, pressure: Tensor) -> Tensor:
        """Of the standard deviation of every reading, (N, 2)."""
        return 1 + self.amount * _relative(self.kind, loads, pressure)


EVEN = Growth()


def grown(
    errors: Tensor, loads: Tensor, pressure: Tensor, tails: Tails, told: Tensor | None = None
) -> tuple[Growth, Tensor]:
    """How errors (N, 2) grow, and the scale (2,) of those at no load or pressure, in the errors' unit.

    told: (N, 2) bool, the errors that there are, all by default."""
    there = np.ones(errors.shape, dtype=bool) if told is None else told.numpy()
    choices = [EVEN, *(Growth(kind, amount) for kind in (LOAD, PRESSURE) for amount in STEPS)]
    tried = [_likelihood(errors, choice.factor(loads, pressure), tails, there) for choice in choices]
    best = int(np.argmax([likelihood for likelihood, _ in tried]))
    if tried[best][0] < tried[0][0] + GROWTH_WORTH:
        best = 0
    return choices[best], torch.as_tensor(tried[best][1])


def _likelihood(errors: Tensor, factor: Tensor, tails: Tails, told: np.ndarray) -> tuple[float, np.ndarray]:
    """Log-likelihood of errors whose scale grows by a factor, (N, 2) each, that scale refitted, and the scale (2,)."""
    z, scale = (errors / factor).numpy(), np.ones(2)
    for _ in range(4):
        good = tails.good(z / scale) * told
        weight = good * tails.weight(z / scale)
        each = np.sqrt((weight * z**2).sum(0) / np.maximum(good.sum(0), 1.0))
        scale = np.where(told.any(0), np.maximum(each, 1e-9), 1.0)
    # Readings that slipped are in the likelihood too: else even noise would be spared what it makes of large errors.
    right = (1 - tails.slipped) * np.exp(tails.log_density(z / scale)) / scale / factor.numpy()
    return float(np.log(right + max(tails.slipped, 1e-6) / SPREAD)[told].sum()), scale


def _relative(kind: str, loads: Tensor, pressure: Tensor) -> Tensor:
    if kind == PRESSURE:
        size = pressure.abs()[:, None].expand_as(loads)
    elif kind == LOAD:
        size = loads.abs()
    else:
        return torch.zeros_like(loads)
    return size / size.amax(0).clamp_min(1e-300)
