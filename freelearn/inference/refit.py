"""A step's model with one effect less."""

from __future__ import annotations

import torch

from freelearn.inference.prepare import Prepared
from freelearn.inference.step import Step
from freelearn.inference.white_fit import white_fit


def without(prepared: Prepared, step: Step, effect: str) -> Step | None:
    """The model refitted without one effect; None when that does not end in a minimum."""
    question = prepared.question
    model = question.build([e for e in step.effects if e != effect])
    known = dict(zip(step.fit.model.labels(), step.fit.vector, strict=True))
    start = torch.stack([known[label] for label in model.labels()])
    fit = white_fit(model, prepared.rows, step.whiten, start, question.prior(model, prepared.spans))
    return prepared.step(fit, step.whiten) if fit.proper else None
