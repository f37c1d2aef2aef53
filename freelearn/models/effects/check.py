"""Whether effects that somebody wrote do what their port asks, told before a fit begins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.errors import UserError
from freelearn.measurements.states import States
from freelearn.models.ports import PORTS, Effect

ROWS = 8


def check_effects(effects: Sequence[Effect], values: Mapping[str, Tensor], states: States) -> None:
    """Calls each effect's own method on a few rows. values: of the model's parameters, SI.

    Raises UserError where one fails, returns what its port does not take, or numbers that are not finite.
    """
    few = states[: min(ROWS, len(states))]
    for effect in effects:
        method = PORTS[effect.port()]
        try:
            with torch.no_grad():
                found = _call(effect, method, values, few)
        except Exception as problem:
            raise UserError(
                f"Effect {effect.name!r}: its {method} failed with {type(problem).__name__}: {problem}"
            ) from None
        for name, value, shape in found:
            if not isinstance(value, Tensor) or tuple(value.shape) != shape:
                got = f"shape {tuple(value.shape)}" if isinstance(value, Tensor) else type(value).__name__
                raise UserError(f"Effect {effect.name!r}: its {method} must return {name} of shape {shape}, not {got}.")
            if not bool(value.isfinite().all()):
                raise UserError(
                    f"Effect {effect.name!r}: its {method} returns {name} that are not finite at ordinary states."
                )


def _call(effect: Effect, method: str, values: Mapping[str, Tensor], states: States) -> list[tuple[str, Any, tuple]]:
    """What the effect's method returns, by name, with the shape that it must have."""
    p, count = effect.own(values, states), len(states)
    loads = torch.ones(count, 2, dtype=torch.float64)
    if method == "psi":
        # Near the reference state, where I₁ = I₂ = 3 and I₄ = 1.
        at = {"i1": 3.1, "i2": 3.1, "i4": 1.02}
        invariants = [torch.full((count,), at[name], dtype=torch.float64) for name in effect.depends_on]
        found = effect.psi(*invariants, p=p, material={name: values[name] for name in ("C1", "C2")})
        return [("energies", found, (count,))]
    if method in ("dissipate", "sense"):
        return [("loads", getattr(effect, method)(loads, states, p), (count, 2))]
    more = [loads] if effect.load_dependent else []
    states = getattr(effect, method)(states, p, *more)
    if not isinstance(states, States):
        raise TypeError(f"it returns {type(states).__name__} and not States: use states.replace(…)")
    names = ("length", "twist", "pressure", "fiber_angle", "reference_length", "inner_radius", "outer_radius")
    return [(f"states with a {name}", getattr(states, name), (count,)) for name in names]
