"""The effects that a configuration may name."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from freelearn.effects.base import Effect
from freelearn.effects.end_clamps import EndClamps
from freelearn.effects.fiber_tension_only import FiberTensionOnly
from freelearn.effects.friction_hysteresis import FrictionHysteresis
from freelearn.effects.sensor_crosstalk import SensorCrosstalk
from freelearn.effects.twist_offset import TwistOffset
from freelearn.effects.wall_stiffening import WallStiffening
from freelearn.errors import UserError

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        FiberTensionOnly,
        WallStiffening,
        EndClamps,
        TwistOffset,
        FrictionHysteresis,
        SensorCrosstalk,
    )
}


def make_effects(names: Sequence[str], model: str) -> list[Effect]:
    """The named effects for a model, in the order given. Raises UserError for what is unknown or does not fit."""
    for i, name in enumerate(names):
        if name not in EFFECTS:
            close = difflib.get_close_matches(str(name), EFFECTS, n=1)
            hint = f" Did you mean {close[0]!r}?" if close else ""
            raise UserError(f"Unknown effect {name!r}.{hint} Available: {', '.join(EFFECTS)}.")
        if name in names[:i]:
            raise UserError(f"Effect {name!r} is named twice: name it once.")
        if model not in EFFECTS[name].models:
            fits = ", ".join(EFFECTS[name].models)
            raise UserError(f"Effect {name!r} cannot join model {model!r}: it works with {fits}.")
    return [EFFECTS[name]() for name in names]
