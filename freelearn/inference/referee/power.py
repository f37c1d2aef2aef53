"""What size of each effect the rows could have shown at all."""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import norm

from freelearn.inference.evidence import log_odds
from freelearn.inference.ranking import Ranking
from freelearn.inference.thresholds import TIES

# Share of the tables in which an effect of the size told would be found.
POWER = 0.8


def visible(ranking: Ranking) -> dict[str, dict[str, float]]:
    """By effect and parameter the smallest size, SI, that a table like this would show in POWER of all cases, alone.

    An effect is told once the evidence for it outweighs its prior odds, what its freedom costs (Laplace), and the
    difference up to which two answers count as equally good; its χ² is then Gaussian about what its size makes."""
    told: dict[str, dict[str, float]] = {}
    for name, part in ranking.parts.items():
        against = TIES - log_odds([name], ranking.odds)
        sizes = {}
        for place, label in enumerate(part.trial.labels):
            p = part.trial.model.declared[label]
            slope = float(part.gram[place, place])
            if p.none is None or p.log or slope <= 0:
                continue
            cost = 0.5 * math.log1p(float(part.covariance[place, place]) * slope)
            sigmas = math.sqrt(2 * (against + cost)) + float(norm.ppf(POWER))
            sizes[label.split(".", 1)[1]] = sigmas / math.sqrt(slope)
        if sizes and all(np.isfinite(list(sizes.values()))):
            told[name] = sizes
    return told
