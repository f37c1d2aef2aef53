"""The distribution of one reading's error: Student's t about what was expected, and a small share that slipped."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaln, stdtrit

# Degrees of freedom that are told apart; infinite is the normal distribution.
FREEDOMS = (3.0, 4.0, 5.0, 7.0, 10.0, 20.0, np.inf)
# Log-likelihood by which heavier tails must do better than normal ones: else bounding errors costs precision for
# nothing (Student's t with 3 degrees of freedom fits 100 normal errors worse by 3 and more).
WORTH = 2.0
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
    _, tails, scale = best if best[0] > normal[0] + WORTH else normal
    return tails, scale
