"""Full fits of models with one effect more, one effect less, or new weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import Tensor

from freelearn.inference.prepare import Prepared
from freelearn.inference.score import EffectScore
from freelearn.inference.step import Step
from freelearn.inference.thresholds import REFITTED
from freelearn.inference.white_fit import GIVEN_UP, WhiteFit, WhiteProblem, white_fit
from freelearn.work import begin

# Times that the way to a start is halved.
HALVINGS = 16


def refit(
    prepared: Prepared, step: Step, scores: Sequence[EffectScore], rival: float | None = None
) -> tuple[dict[str, Step], list[EffectScore]]:
    """Full fits of the step's model with each of the most promising effects, by name, and the scores with what became
    of them: an effect whose fit does not reach a minimum has failed.

    rival: χ² of a model that the fits have to match; none, and they have to match the best of themselves. One that
    clearly cannot is given up, and is neither fitted nor failed.
    """
    fitted: dict[str, Step] = {}
    failed: set[str] = set()
    promising = sorted((s for s in scores if s.status == "tested" and s.gain > 0), key=lambda s: -s.evidence)
    for s in promising[:REFITTED]:
        assert s.start is not None
        assert s.still is not None
        best = rival if rival is not None else min((other.fit.chi2 for other in fitted.values()), default=None)
        effects = [*step.effects, s.effect]
        begin(f"trying {' + '.join(effects)}")
        model = prepared.question.build(effects)
        start = _sound(WhiteProblem(model, prepared.rows, step.whiten), s.still, s.start, step.fit.chi2)
        fit = white_fit(model, prepared.rows, step.whiten, start, best)
        if fit.message == GIVEN_UP:
            continue
        if proper(fit):
            fitted[s.effect] = prepared.step(effects, fit, step.whiten)
        else:
            failed.add(s.effect)
    reason = "its fit did not reach a minimum"
    noted = [replace(s, status="failed", reason=reason, p_value=1.0) if s.effect in failed else s for s in scores]
    return fitted, noted


def without(prepared: Prepared, step: Step, effect: str) -> Step | None:
    """The step's model without one effect, refitted; None when that does not end in a minimum."""
    effects = [e for e in step.effects if e != effect]
    known = dict(zip(step.fit.model.labels(), step.fit.vector, strict=True))
    start = torch.stack([known[label] for label in prepared.question.build(effects).labels()])
    fit = white_fit(prepared.question.build(effects), prepared.rows, step.whiten, start)
    return prepared.step(effects, fit, step.whiten) if proper(fit) else None


def rewhitened(prepared: Prepared, step: Step) -> Step:
    """The same model with the noise that its own stiffness implies, unless it would then explain less."""
    whiten = prepared.whitener(step)
    fit = white_fit(step.fit.model, prepared.rows, whiten, step.fit.vector)
    again = prepared.step(step.effects, fit, whiten)
    return step if again.worse(step) else again


def proper(fit: WhiteFit) -> bool:
    """Whether a fit ended in a minimum with an answer for every row."""
    return fit.converged and bool(fit.residual.isfinite().all())


@torch.no_grad()
def _sound(problem: WhiteProblem, still: Tensor, start: Tensor, chi2: float) -> Tensor:
    """The start (p,), or as much of the way to it from where the effect does nothing as does not raise χ².

    What a linear effect promises may lie far beyond where it is linear: where no row has an equilibrium, perhaps.
    """
    for halvings in range(HALVINGS):
        nearer = still + 0.5**halvings * (start - still)
        if float(problem.residuals(nearer[None]).square().sum()) <= chi2:
            return nearer
    return still
