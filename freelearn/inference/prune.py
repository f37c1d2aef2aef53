"""Takes out effects that those added later have made superfluous."""

from __future__ import annotations

import torch

from freelearn.inference.covariance import parameter_covariance
from freelearn.inference.crossval import paired
from freelearn.inference.prepare import Prepared
from freelearn.inference.refit import rewhitened, without
from freelearn.inference.step import Step
from freelearn.inference.thresholds import BETTER, CERTAIN


def prune(prepared: Prepared, step: Step) -> Step:
    """The step's model without its idle effects; the last one added, and those given, stay in any case."""
    for effect in prepared.question.added(step.effects)[:-1]:
        if certain(step, effect):
            continue
        reduced = without(prepared, step, effect)
        if reduced is None:
            continue
        gain, error = paired(step.heldout, reduced.heldout)
        if gain < BETTER * error and not reduced.worse(step):
            return prune(prepared, rewhitened(prepared, reduced))
    return step


def certain(step: Step, effect: str) -> bool:
    """Whether Wald's test alone says that the effect is not idle, so that no refit need be spent on it."""
    declared, values = step.fit.model.declared, step.fit.values()
    away = {n: values[n] - p.none for n, p in declared.items() if n.startswith(f"{effect}.") and p.none is not None}
    place = [list(declared).index(label) for label in away]
    size = torch.tensor(list(away.values()), dtype=torch.float64)
    covariance = parameter_covariance(step)[place][:, place]
    return float(size @ torch.linalg.pinv(covariance, hermitian=True) @ size) > CERTAIN**2 * len(size)
