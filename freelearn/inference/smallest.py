"""The smallest model that leaves about the same unexplained."""

from __future__ import annotations

from freelearn.inference.prepare import Prepared
from freelearn.inference.refit import rewhitened, without
from freelearn.inference.step import Step
from freelearn.inference.thresholds import LITTLE


def smallest(prepared: Prepared, final: Step) -> Step:
    """A model that stays unexplained, without the effects that explain little beside what stays so.

    Something that is not in the library can be mimicked a little by many that are; added one by one, each makes χ²
    fall, and together they would be taken for findings.
    """
    step = final
    while added := prepared.question.added(step.effects):
        reduced = [r for r in (without(prepared, step, effect) for effect in added) if r is not None]
        least = min(reduced, key=_loss, default=None)
        if least is None or _loss(least) - _loss(step) > LITTLE * _unexplained(step) or least.worse(step):
            break
        step = least
    return step if step is final else rewhitened(prepared, step)


def _loss(step: Step) -> float:
    return float(step.heldout.loss.sum())


def _unexplained(step: Step) -> float:
    """Held-out χ² beyond what noise makes of it: one for each reading that did not slip."""
    scatter = step.whiten.scatter
    count = step.whiten.count - (0 if scatter is None else int(scatter.slipped.sum()))
    return max(_loss(step) - count, 0.0)
