"""Whether effects that somebody wrote do what their port asks, told before a fit begins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.data.recordings import Recording
from freelearn.data.states import States
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.material import Material
from freelearn.physics.chain.ports import (
    BoundaryEffect,
    DissipationEffect,
    EnergyEffect,
    EvasionEffect,
    GeometryEffect,
    HistoryEffect,
    MeasurementEffect,
    MountEffect,
    PlayEffect,
    TiltEffect,
    WallEffect,
)

ROWS = 8
# Near the reference state, where I₁ = I₂ = 3 and I₄ = 1.
ORDINARY = {"i1": 3.1, "i2": 3.1, "i4": 1.02}
# What of the states an effect may change.
CHANGED = ("length", "twist", "pressure", "fiber_angle", "reference_length", "inner_radius", "outer_radius")

# What a method returned: what to call it, the value, and the shape that it must have.
Returned = tuple[str, object, tuple[int, ...]]


def check_effects(effects: Sequence[Effect[Any]], values: Mapping[str, Tensor], states: States) -> None:
    """Calls each effect's own method on a few rows. values: of the model's parameters, SI.

    Raises UserError where one cannot be told on the bed of the states, fails, returns what its port does not take, or
    numbers that are not finite.
    """
    few = states[: min(ROWS, len(states))]
    for effect in effects:
        if reason := effect.untold(states.bed.name):
            raise UserError(f"Effect {effect.name!r} {reason}. Leave it out here.")
        if effect.compares and len(effect.members or effect.samples) < 2:
            raise UserError(
                f"Effect {effect.name!r} compares samples, or actuators on one end block, that have values of their "
                "own: of one alone, or with per_sample=false, there is nothing to compare. Leave it out here."
            )
        method = effect.method
        try:
            with torch.no_grad():
                returned = _call(effect, values, few)
        except Exception as problem:
            raise UserError(
                f"Effect {effect.name!r}: its {method} failed with {type(problem).__name__}: {problem}"
            ) from None
        for name, value, shape in returned:
            if not isinstance(value, Tensor) or tuple(value.shape) != shape:
                got = f"shape {tuple(value.shape)}" if isinstance(value, Tensor) else type(value).__name__
                raise UserError(f"Effect {effect.name!r}: its {method} must return {name} of shape {shape}, not {got}.")
            if not bool(value.isfinite().all()):
                raise UserError(
                    f"Effect {effect.name!r}: its {method} returns {name} that are not finite at ordinary states."
                )
            if name == "factors" and not bool((value > 0).all()):
                raise UserError(f"Effect {effect.name!r}: its {method} must return factors greater than zero.")
            if name in ("widths", "compliances") and not bool((value >= 0).all()):
                raise UserError(f"Effect {effect.name!r}: its {method} must return {name} of zero or more.")


def _call(effect: Effect[Any], values: Mapping[str, Tensor], states: States) -> list[Returned]:
    """What the effect's method returns at these states."""
    p, count = effect.own(values, states), len(states)
    loads = torch.ones(count, 2, dtype=states.length.dtype, device=states.length.device)
    if isinstance(effect, EnergyEffect):
        invariants = [torch.full_like(states.length, ORDINARY[name]) for name in effect.depends_on]
        material = Material(C1=values["C1"], C2=values["C2"])
        return [("energies", effect.psi(*invariants, p=p, material=material), (count,))]
    if isinstance(effect, DissipationEffect):
        return [("loads", effect.dissipate(loads, states, p), (count, 2))]
    if isinstance(effect, EvasionEffect):
        return [("loads", effect.evade(loads, states, p), (count, 2))]
    if isinstance(effect, MeasurementEffect):
        return [("loads", effect.sense(loads, states, p), (count, 2))]
    if isinstance(effect, HistoryEffect):
        time = torch.arange(count, dtype=loads.dtype)
        recording = Recording(states, torch.zeros(count, dtype=torch.int64), time)
        signal = time[:, None].expand(-1, 1 if effect.acts_on == "supply" else 2)
        return [("signals", effect.carry(signal, recording, p), tuple(signal.shape))]
    if isinstance(effect, WallEffect):
        return [("factors", effect.soften(states, p), (count,))]
    if isinstance(effect, PlayEffect):
        width = effect.play(states, p)
        return [("widths", width, () if isinstance(width, Tensor) and not width.ndim else (count,))]
    if isinstance(effect, TiltEffect):
        soft = effect.tilt(states, p)
        return [("compliances", soft, () if isinstance(soft, Tensor) and not soft.ndim else (count,))]
    changed = _states(effect, states, loads, p)
    if not isinstance(changed, States):
        raise TypeError(f"it returns {type(changed).__name__} and not States: use states.replace(…)")
    returned: list[Returned] = [(f"states with a {name}", getattr(changed, name), (count,)) for name in CHANGED]
    if isinstance(effect, BoundaryEffect):
        returned.append(("loads (by hand_on)", effect.hand_on(loads, states, p), (count, 2)))
    return returned


def _states(effect: Effect[Any], states: States, loads: Tensor, p: Any) -> object:
    if isinstance(effect, MountEffect):
        return effect.impose(states, loads, p)
    if isinstance(effect, BoundaryEffect):
        return effect.impose(states, p)
    assert isinstance(effect, GeometryEffect)
    return effect.reshape(states, p)
