"""The smallest model that leaves the same unexplained."""

from __future__ import annotations

from freelearn.inference.prepare import Prepared
from freelearn.inference.refit import rewhitened, without
from freelearn.inference.step import Step
from freelearn.inference.thresholds import SAME_ERROR


def smallest(prepared: Prepared, final: Step) -> Step:
    """A model that stays unexplained, without the effects that the error of held-out states hardly needs.

    Something that is not in the library can be mimicked a little by many that are; added one by one, each makes χ²
    fall, and together they would be taken for findings.
    """
    most, step = (1 + SAME_ERROR) * final.E_heldout, final
    while added := prepared.question.added(step.effects):
        reduced = [r for r in (without(prepared, step, effect) for effect in added) if r is not None]
        least = min(reduced, key=lambda r: r.E_heldout, default=None)
        if least is None or least.E_heldout > most:
            break
        step = least
    return step if step is final else rewhitened(prepared, step)
