"""From what a user states of parameters to what is known of them, with every mistake in it told."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from freelearn.common.errors import UserError, unknown
from freelearn.physics.chain.known_parameters import Known
from freelearn.physics.chain.material import material
from freelearn.physics.chain.parameters import Parameter, Prior
from freelearn.physics.effects.registry import EFFECTS
from freelearn.physics.models.build import MODELS

# Where a prior comes from that a user gave.
USER = "given by the user"


def stated(
    model: str,
    effects: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
    errors: Mapping[str, float] | None = None,
    fix: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    of: str | None = None,
    priors: bool = True,
    tried: bool = True,
) -> Known:
    """What is known beforehand, of parameters by name (C1, end_clamps.clamp_length, length_offset.length[3]).

    values, errors: value and one standard deviation, SI. effects: those that the model has. fix: held at their value.
    bounds: lowest and highest value, SI. of: the wall's material (material). priors: False where those declared
    count for nothing; what is stated here does. tried: whether other effects may join the model. Raises UserError.

    >>> stated("continuum", values={"C1": 1.2e6}, errors={"C1": 2e5}, fix=["C2"]).priors["C1"].middle
    1200000.0
    """
    values, errors, bounds = values or {}, errors or {}, bounds or {}
    declared = _declared(model)
    for name in dict.fromkeys([*values, *errors, *fix, *bounds]):
        _check_name(name, model, effects, declared)
        if not tried and "." in name and _effect(name) not in effects:
            raise UserError(f"{name} is set, but the model has no {_effect(name)}: add it to effects=[…].")
    for name, limits in bounds.items():
        _check_bounds(name, limits, values, effects, declared)
    for name in fix:
        _check_fixed(name, values, effects, declared)
    known = {name: _prior(name, values[name], error, fix, declared) for name, error in errors.items()}
    starts = {name: value for name, value in values.items() if "." in name}
    if of is not None:
        stock = material(of)
        if "C1" not in declared:
            raise UserError(f"material gives C1, which model {model} does not have: leave it out.")
        if "C1" in errors:
            raise UserError("model.C1 with an error and material both say what C1 is: leave one of them out.")
        if values.get("C1", declared["C1"].start) != declared["C1"].start:
            raise UserError("model.C1 and material both say what C1 is: leave one of them out.")
        known["C1"], starts["C1"] = stock.prior, stock.C1
        if stock.fiber is not None and "C2" in declared and "C2" not in errors:
            known["C2"] = stock.fiber
            if values.get("C2", declared["C2"].start) == declared["C2"].start:
                starts["C2"] = stock.fiber.middle
    return Known(starts, tuple(fix), dict(bounds), known, not priors)


def _declared(model: str) -> dict[str, Parameter]:
    """All parameters that the model could have, by label, with every effect."""
    own = {p.name: p for p in MODELS[model].parameter_class.records()}
    return own | {f"{name}.{p.name}": p for name, kind in EFFECTS.items() for p in kind.declared_parameters()}


def _check_name(name: str, model: str, effects: Sequence[str], declared: Mapping[str, Parameter]) -> None:
    """Whether there is a parameter of this name."""
    whole = name.split("[")[0]
    if whole in declared:
        return
    own = [label for label in declared if _effect(label) == _effect(whole)]
    if "." in whole and own:
        raise unknown("parameter", name, own)
    if "." in whole:
        raise unknown("effect", _effect(whole), list(EFFECTS))
    if not MODELS[model].parameter_class.records():
        raise UserError(f"Model {model} has no physical parameter of its own, so no {name}: leave it out.")
    raise unknown(f"parameter of model {model}:", name, [n for n in declared if "." not in n or _effect(n) in effects])


def _check_bounds(
    name: str,
    limits: tuple[float, float],
    values: Mapping[str, float],
    effects: Sequence[str],
    declared: Mapping[str, Parameter],
) -> None:
    """Whether bounds leave room for the value given, and for no effect where that is to be tried."""
    low, high = limits
    if low >= high:
        raise UserError(f"bounds.{name} = [{low:g}, {high:g}] hold nothing: give the lower one first, or fix it.")
    p = declared[name.split("[")[0]]
    value = values.get(name)
    if value is not None and value != p.start and not low <= value <= high:
        raise UserError(f"model.{name} = {value:g} is outside bounds.{name} = [{low:g}, {high:g}]: change one of them.")
    if not _may_be_absent(name, low, high, effects, p):
        raise UserError(
            f"bounds.{name} = [{low:g}, {high:g}] say that it is there: add {_effect(name)} to effects=[…]."
        )


def _check_fixed(
    name: str, values: Mapping[str, float], effects: Sequence[str], declared: Mapping[str, Parameter]
) -> None:
    """Whether a parameter that is held has a value to be held at; the model's own always have."""
    value = values.get(name, values.get(name.split("[")[0]))
    if "." not in name:
        return
    if value is None:
        raise UserError(f"fix names {name}, but not its value: add +model.{name}=VALUE, in SI.")
    if not _may_be_absent(name, value, value, effects, declared[name.split("[")[0]]):
        raise UserError(
            f"{name} is fixed at {value:g}, which says that it is there: add {_effect(name)} to effects=[…]."
        )


def _may_be_absent(name: str, low: float, high: float, effects: Sequence[str], p: Parameter) -> bool:
    """Whether values from low to high leave open what is open, that the model lacks the parameter's effect."""
    return "." not in name or _effect(name) in effects or p.none is None or low <= p.none <= high


def _effect(name: str) -> str:
    return name.split(".")[0]


def _prior(name: str, value: float, error: float, fix: Sequence[str], declared: Mapping[str, Parameter]) -> Prior:
    """Of a value with an error."""
    if name in fix:
        raise UserError(f"{name} is fixed and has an error: leave one of them out.")
    if not error > 0:
        raise UserError(
            f"model.{name} = {value:g}±{error:g}: the error must be more than zero; fix it where it has none."
        )
    p = declared[name.split("[")[0]]
    if not p.log:
        return Prior(value, error, USER)
    if not value > 0:
        raise UserError(f"model.{name} = {value:g}±{error:g} is not possible: it is positive.")
    return Prior(value, math.log1p(error / value), USER)
