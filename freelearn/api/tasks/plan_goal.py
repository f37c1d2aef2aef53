"""What a user asks a plan for, as a goal with fitted models behind it."""

from __future__ import annotations

import numpy as np
import torch

from freelearn.api.settings.plan_settings import PlanSettings
from freelearn.api.tasks.plan_source import Source
from freelearn.design.goals import HALVE, SETTLE, SPLIT, Goal, Narrow, Split
from freelearn.errors import UserError, unknown
from freelearn.inference.derivatives import none_vector
from freelearn.inference.linear_algebra import normal_inverse
from freelearn.inference.white_fit import WhiteFit
from freelearn.models.effects.registry import EFFECTS, missing_columns
from freelearn.models.parameter import Parameter


def goal_of(settings: PlanSettings, source: Source) -> Goal:
    """The goal. Raises UserError where the run has nothing of the kind."""
    if settings.goal == SETTLE:
        return _settle(source, str(settings.effect))
    if settings.goal == HALVE:
        return _halve(source, str(settings.parameter))
    classes = source.classes()
    if classes:
        return Split.of(classes)
    if settings.goal == SPLIT:
        what = "its verdict is " + str(source.content["verdict"]) if source.kind == "discover" else "it is one of train"
        raise UserError(f"{source.folder} has no class of effects to split, {what}: choose goal=settle or goal=halve.")
    return _halve(source, widest(source))


def widest(source: Source) -> str:
    """The parameter with the widest interval for its size; of those that nothing is known of, none."""
    fit = source.known.fit
    variance = normal_inverse(fit.jacobian.flatten(0, 1)).diagonal().clamp_min(0)
    width = {}
    for label, parameter in fit.model.declared.items():
        place = fit.model.labels().index(label)
        size = _size(parameter, fit, label)
        if float(variance[place]) > 0 and (parameter.log or fit.values()[label] != 0):
            width[label] = float(variance[place]) ** 0.5 / size
    if not width:
        raise UserError(f"{source.folder} has no parameter whose interval is known: choose goal=settle, effect=NAME.")
    return max(width, key=lambda label: width[label])


def _halve(source: Source, name: str) -> Goal:
    fit = source.known.fit
    if name not in fit.model.declared:
        raise unknown("parameter", name, fit.model.declared)
    return Narrow(HALVE, ((name,),), fit, (name,), (_size(fit.model.declared[name], fit, name),))


def _settle(source: Source, name: str) -> Goal:
    if name not in EFFECTS:
        raise unknown("effect", name, EFFECTS)
    known, model = source.known, source.model
    if name in source.effects:
        fit = known.fit
    else:
        more = source.build([*source.effects, name])
        if lacking := missing_columns(more.effects, known.table.columns):
            raise UserError(lacking)
        if reason := EFFECTS[name].untold(known.rows.states.bed.name):
            raise UserError(f"{name} cannot be settled: it {reason}.")
        fit = known.unfitted(more, none_vector(more, known.fit))
        model = more
    own = {label: p for label, p in model.declared.items() if label.startswith(f"{name}.")}
    # What is undefined without the effect is no sign of it.
    own = {label: p for label, p in own.items() if p.none is not None} or own
    sizes = tuple(_size(p, fit, label) for label, p in own.items())
    return Narrow(SETTLE, ((name,),), fit, tuple(own), sizes)


def _size(parameter: Parameter, fit: WhiteFit, label: str) -> float:
    """What counts as one of a raw parameter: its own value, or where it has none a noticeable one."""
    if parameter.log:
        return 1.0
    with torch.no_grad():
        value = abs(float(fit.model.physical(fit.vector)[label]))
    return value or abs(parameter.scale or parameter.start) or 1.0


def present_value(goal: Narrow) -> np.ndarray:
    """Physical values of a goal's parameters, SI, (q,)."""
    assert goal.fit is not None
    with torch.no_grad():
        values = goal.fit.model.physical(goal.fit.vector)
    return np.array([float(values[label]) for label in goal.labels])
