"""Would the answer be the same without any one state, and with other accuracies?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import torch

from freelearn.inference.answer import Answer, believed
from freelearn.inference.evidence import log_evidence, log_odds
from freelearn.inference.hypotheses import Hypotheses
from freelearn.inference.hypothesis import Hypothesis
from freelearn.inference.left_out import left_out
from freelearn.inference.referee.case import Case
from freelearn.inference.referee.check import CANNOT, FAIL, PASS, Check
from freelearn.inference.thresholds import TIES
from freelearn.inference.white_fit import WhiteProblem

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
    own, *others = (_rest(case, h, parts) for h in (answer.shown, *rivals))
    return {
        f"without part {int(number) + 1} of the states": bool(max(o[i] for o in others) > own[i] + TIES)
        for i, number in enumerate(numbers)
    }


def _rest(case: Case, hypothesis: Hypothesis, parts: list[np.ndarray]) -> np.ndarray:
    """Evidence of a set without each part: its sum of squares refitted, the rest as with all rows."""
    fit = hypothesis.fit
    vectors = torch.stack(left_out(fit, case.rows, case.whiten, parts))
    problem = WhiteProblem(fit.model, case.rows, case.whiten, fit.prior, fit.near)
    with torch.no_grad():
        white = problem.residuals(vectors)[:, : 2 * len(case.rows)].reshape(len(parts), len(case.rows), 2)
    stays = torch.as_tensor(~np.array(parts))
    chi2 = (white.square().sum(-1) * stays).sum(1).numpy()
    whole: np.ndarray = hypothesis.evidence + 0.5 * fit.chi2 - 0.5 * chi2
    return whole
