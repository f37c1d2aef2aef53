"""Would the answer be the same without any one state; what size of each effect could the rows have shown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.stats import norm

from freelearn.discovery.fits.journal import ahead
from freelearn.discovery.fits.left_out import left_out
from freelearn.discovery.referee.case import CANNOT, FAIL, PASS, Case, Check
from freelearn.discovery.search.answer import Answer, believed
from freelearn.discovery.search.hypotheses import Hypotheses
from freelearn.discovery.search.hypothesis import Hypothesis, log_evidence, log_odds
from freelearn.discovery.search.ranking import Ranking
from freelearn.discovery.thresholds import TIES

# Would the answer be the same without any one state, and with other accuracies?

# Sets that are compared, share of the cases in which another may win, and factors of the accuracy.
COMPARED, OTHERS = 6, 1 / 3
FACTORS = (0.5, 2.0)


def stability(case: Case, hypotheses: Hypotheses, answer: Answer) -> list[Check]:
    """Of the sets that are nearly as good, which wins where."""
    every = [believed(h, hypotheses) for h in hypotheses.ordered()]
    near = [h for h in every if h.evidence > answer.shown.evidence - 4 * TIES][:COMPARED]
    rivals = [h for h in near if _contradicts(h, answer)]
    if not rivals:
        return [Check("stability", PASS, 0.0, OTHERS, "No other answer comes near.")]
    wins = _without_states(case, hypotheses, answer, rivals)
    wins |= {
        f"an accuracy {factor:g} times as stated": _noisier(answer, rivals, factor, hypotheses.odds)
        for factor in FACTORS
    }
    lost = [name for name, won in wins.items() if won]
    share = len(lost) / len(wins)
    if share > OTHERS:
        says = f"Another answer would win in {len(lost)} of {len(wins)} cases: {', '.join(lost[:3])}."
        return [Check("stability", FAIL, share, OTHERS, says)]
    result = CANNOT if lost else PASS
    says = f"The answer is the same but for {', '.join(lost)}." if lost else "The answer is the same without any state."
    return [Check("stability", result, share, OTHERS, says, decides=False)]


def _contradicts(other: Hypothesis, answer: Answer) -> bool:
    """Whether a set lacks something of the answer and what stands in for it."""
    return any(not set(members) & other.key for members in answer.classes) or (
        not answer.classes and bool(other.effects)
    )


def _noisier(answer: Answer, rivals: list[Hypothesis], factor: float, odds: Mapping[str, float]) -> bool:
    """Whether another set would be clearly more probable if all noise were so many times as large."""
    own = _evidence(answer.shown, factor, odds)
    return max(_evidence(h, factor, odds) for h in rivals) > own + TIES


def _evidence(hypothesis: Hypothesis, factor: float, odds: Mapping[str, float]) -> float:
    fit = hypothesis.fit
    scaled = replace(fit, residual=fit.residual / factor, jacobian=fit.jacobian / factor)
    return log_evidence(scaled, hypothesis.effects) + log_odds(hypothesis.effects, odds)


def _without_states(case: Case, hypotheses: Hypotheses, answer: Answer, rivals: list[Hypothesis]) -> dict[str, bool]:
    """Of each part of the states left out, whether another set is then clearly more probable."""
    numbers = np.unique(case.fold)
    parts = [case.fold == number for number in numbers]
    compared = (answer.shown, *rivals)
    ahead([partial(_rest, case, h, parts) for h in compared])
    own, *others = (_rest(case, h, parts) for h in compared)
    return {
        f"without part {int(number) + 1} of the states": bool(max(o[i] for o in others) > own[i] + TIES)
        for i, number in enumerate(numbers)
    }


def _rest(case: Case, hypothesis: Hypothesis, parts: list[np.ndarray]) -> np.ndarray:
    """Evidence of a set without each part: its sum of squares refitted, the rest as with all rows."""
    fit = hypothesis.fit
    chi2 = left_out(fit, case.rows, case.whiten, parts).chi2.numpy()
    whole: np.ndarray = hypothesis.evidence + 0.5 * fit.chi2 - 0.5 * chi2
    return whole


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
