"""Which effects the residuals of a step ask for, and what came of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from freelearn.inference.candidate import Candidate
from freelearn.inference.prepare import Prepared
from freelearn.inference.score import EffectScore, score_effects
from freelearn.inference.step import Step


def rank(prepared: Prepared, step: Step, names: Sequence[str], scale: float) -> list[EffectScore]:
    """Scores of the named effects on top of the step's model. scale: of the noise, in units of the stated one."""
    question = prepared.question
    on = question.on(step.effects)
    return score_effects(step.fit, prepared.rows, step.whiten, names, on, scale**2, question.seed)


def outcomes(number: int, scores: Sequence[EffectScore], fitted: Mapping[str, Step]) -> list[Candidate]:
    """Entries of discovery.json for the candidates of one step. number: the step's place in the trail."""
    return [
        Candidate(
            step=number,
            effect=s.effect,
            status=s.status,
            reason=s.reason,
            score=s.gain,
            p_value=s.p_value if s.status == "tested" else None,
            E_heldout=fitted[s.effect].E_heldout if s.effect in fitted else None,
            E_new_sample=fitted[s.effect].E_new_sample if s.effect in fitted else None,
        )
        for s in scores
    ]
