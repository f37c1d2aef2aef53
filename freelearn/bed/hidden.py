"""Effects hidden in the simulated bed, by name or drawn at random, for blind tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from freelearn.errors import UserError
from freelearn.measurements.beds import KINEMATIC
from freelearn.models.effect import Effect
from freelearn.models.effects.registry import EFFECTS, make_effects
from freelearn.models.parameter import Parameter

# A drawn effect is between half and twice as large as a noticeable one.
SMALLEST, LARGEST = 0.5, 2.0
# Share of draws that hide one effect; the others hide two.
ONE = 0.6
# What is seen of braids and of several actuators on one end block alone: the simulated bed has one helix each.
ELSEWHERE = ("bladder_slack", "strand_jamming", "block_tilt")

Hidden = dict[str, dict[str, float]]


def hidden_effects(hidden: Any, seed: int) -> Hidden:
    """Effects with their parameters, SI, from `data.hidden`: a list of names, {name: {parameter: value}} or "random".

    Named effects have the size that their parameters declare as noticeable. Raises UserError.
    """
    if hidden == "random":
        return _drawn(seed)
    if isinstance(hidden, Mapping):
        chosen = {str(name): dict(values or {}) for name, values in hidden.items()}
    elif isinstance(hidden, list):
        chosen = {str(name): {} for name in hidden}
    else:
        raise UserError(f"data.hidden = {hidden!r}: give a list of effect names, for example [end_clamps], or random.")
    sizes = {}
    for effect in make_effects(list(chosen), "continuum"):
        known = [p.name for p in effect.declared_parameters()]
        for name in chosen[effect.name]:
            if name not in known:
                raise UserError(f"Effect {effect.name!r} has no parameter {name!r}: it has {', '.join(known)}.")
        sizes[effect.name] = {
            p.name: float(chosen[effect.name].get(p.name, _noticeable(p))) for p in effect.declared_parameters()
        }
    return sizes


def _noticeable(p: Parameter) -> float:
    assert p.scale is not None
    return p.scale if p.none is not None else p.start


def _drawn(seed: int) -> Hidden:
    generator = np.random.default_rng([seed, 4242])
    count = 1 if generator.random() < ONE else 2
    able = [n for n, effect in EFFECTS.items() if "continuum" in effect.families() and _shows(n)]
    names = generator.choice(able, count, replace=False)
    return {str(name): _sized(EFFECTS[str(name)], generator) for name in names}


def _shows(name: str) -> bool:
    """Whether an effect shows in the simulated bed, a kinematic one: of the history nothing does in plateaus."""
    effect = EFFECTS[name]
    return effect.port != "history" and name not in ELSEWHERE and not effect.untold(KINEMATIC.name)


def _sized(effect: type[Effect[Any]], generator: np.random.Generator) -> dict[str, float]:
    values = {}
    for p in effect.declared_parameters():
        factor = SMALLEST * (LARGEST / SMALLEST) ** generator.random()
        sign = -1.0 if p.none is not None and p.lower < p.none and generator.random() < 0.5 else 1.0
        values[p.name] = float(np.clip(sign * factor * _noticeable(p), p.lower, p.upper))
    return values
