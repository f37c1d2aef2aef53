"""The effects that a configuration may name."""

from __future__ import annotations

import difflib
import importlib.util
import math
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from freelearn.errors import UserError
from freelearn.models.effects.end_clamps import EndClamps
from freelearn.models.effects.fiber_dispersion import FiberDispersion
from freelearn.models.effects.fiber_misalignment import FiberMisalignment
from freelearn.models.effects.fiber_stiffening import FiberStiffening
from freelearn.models.effects.fiber_tension_only import FiberTensionOnly
from freelearn.models.effects.force_gain import ForceGain
from freelearn.models.effects.force_offset import ForceOffset
from freelearn.models.effects.friction_hysteresis import FrictionHysteresis
from freelearn.models.effects.length_compliance import LengthCompliance
from freelearn.models.effects.length_offset import LengthOffset
from freelearn.models.effects.limited_extensibility import LimitedExtensibility
from freelearn.models.effects.moment_gain import MomentGain
from freelearn.models.effects.moment_offset import MomentOffset
from freelearn.models.effects.pressure_gain import PressureGain
from freelearn.models.effects.pressure_offset import PressureOffset
from freelearn.models.effects.relaxation import Relaxation
from freelearn.models.effects.second_invariant import SecondInvariant
from freelearn.models.effects.sensor_crosstalk import SensorCrosstalk
from freelearn.models.effects.sensor_drift import SensorDrift
from freelearn.models.effects.stress_softening import StressSoftening
from freelearn.models.effects.twist_compliance import TwistCompliance
from freelearn.models.effects.twist_offset import TwistOffset
from freelearn.models.effects.twist_slack import TwistSlack
from freelearn.models.effects.wall_stiffening import WallStiffening
from freelearn.models.effects.wall_thickness import WallThickness
from freelearn.models.ports import Effect

# In the order in which they act, within each port.
EFFECTS: dict[str, type[Effect]] = {}


def register(effect: type[Effect]) -> None:
    """Makes an effect known by its name. Raises TypeError where its class is not a proper effect."""
    name = getattr(effect, "name", None)
    if not isinstance(name, str) or not name.isidentifier():
        raise TypeError(f"its name {name!r} is not a word of letters, digits and underscores")
    if name in EFFECTS:
        raise TypeError(f"its name {name!r} is taken")
    if effect.port() == "energy":
        if not effect.depends_on or not set(effect.depends_on) <= {"i1", "i2", "i4"}:
            raise TypeError(f"its depends_on {effect.depends_on} must name invariants: i1, i2, i4")
        if any(p.per_sample for p in effect.parameters):
            raise TypeError("the parameters of an energy are shared by all samples, and one of them is per_sample")
    for p in effect.parameters:
        numbers = [p.start, p.scale, *([] if p.none is None else [p.none])]
        if not all(isinstance(v, int | float) and math.isfinite(v) for v in numbers):
            raise TypeError(f"start, scale and none of its parameter {p.name!r} must be finite numbers")
        if not p.allows(p.start) or not (p.none is None or p.lower <= p.none <= p.upper):
            raise TypeError(f"start and none of its parameter {p.name!r} must lie within its bounds")
    EFFECTS[name] = effect


for _effect in (
    SecondInvariant,
    WallStiffening,
    LimitedExtensibility,
    FiberStiffening,
    FiberTensionOnly,
    FiberDispersion,
    FiberMisalignment,
    WallThickness,
    EndClamps,
    LengthOffset,
    TwistOffset,
    TwistSlack,
    LengthCompliance,
    TwistCompliance,
    PressureOffset,
    PressureGain,
    FrictionHysteresis,
    Relaxation,
    StressSoftening,
    ForceOffset,
    MomentOffset,
    ForceGain,
    MomentGain,
    SensorCrosstalk,
    SensorDrift,
):
    register(_effect)


def make_effects(names: Sequence[str], family: str, samples: Sequence[int] = ()) -> list[Effect]:
    """The named effects for a family of models, in the order of the registry whatever the order of the names.

    samples: those of the training set; with several, some parameters have one value for each (see Effect).
    Raises UserError for what is unknown or does not fit.
    """
    for i, name in enumerate(names):
        if name not in EFFECTS:
            close = difflib.get_close_matches(str(name), EFFECTS, n=1)
            hint = f" Did you mean {close[0]!r}?" if close else ""
            raise UserError(f"Unknown effect {name!r}.{hint} Available: {', '.join(EFFECTS)}.")
        if name in names[:i]:
            raise UserError(f"Effect {name!r} is named twice: name it once.")
        if family not in EFFECTS[name].models:
            fits = ", ".join(EFFECTS[name].models)
            raise UserError(f"Effect {name!r} cannot join model {family!r}: it works with {fits}.")
    return [effect(samples) for name, effect in EFFECTS.items() if name in names]


def missing_columns(effects: Iterable[Effect], table_columns: Iterable[str]) -> str | None:
    """What to tell the user when the table lacks a column that an effect needs; None when it has all."""
    present = set(table_columns)
    for effect in effects:
        for column in effect.needs:
            if column not in present:
                return (
                    f"Effect {effect.name!r} needs the column {column}, which the table lacks: "
                    "add the column or leave the effect out."
                )
    return None


# Files that `load_own` has read, and the names it found in them.
_OWN: dict[Path, list[str]] = {}


def load_own(paths: Sequence[str]) -> list[str]:
    """Registers the effects that a user wrote, from Python files named by path; returns the effects' names.

    This runs the files. Call it only with paths that the user typed on the command line or in the environment,
    never with any from data, a checkpoint or a stored configuration. Raises UserError.
    """
    found: list[str] = []
    for given in paths:
        path = Path(given).expanduser().resolve()
        if path not in _OWN:
            _OWN[path] = _read_own(path, given)
        found += _OWN[path]
    return found


def _read_own(path: Path, given: str) -> list[str]:
    if path.suffix != ".py" or not path.is_file():
        raise UserError(f"{given} is not a Python file with an effect: give the path of an existing .py file.")
    module_name = f"freelearn_own_{len(_OWN)}_{path.stem}"
    spec = importlib.util.spec_from_file_location(module_name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # Where inspect and pickle look for the source of a class.
    sys.modules[module_name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as problem:
        del sys.modules[module_name]
        reason = f"{type(problem).__name__}: {problem}".splitlines()[0]
        raise UserError(f"{given} does not run ({reason}): mend it and try again.") from problem
    own = [v for v in vars(module).values() if isinstance(v, type) and issubclass(v, Effect)]
    own = [effect for effect in dict.fromkeys(own) if effect.__module__ == module_name]
    if not own:
        raise UserError(f"{given} holds no effect: write a class derived from freelearn.models.ports.Effect in it.")
    names: list[str] = []
    for effect in own:
        try:
            register(effect)
        except TypeError as problem:
            for name in names:
                del EFFECTS[name]
            raise UserError(f"Class {effect.__name__} in {given} is not an effect: {problem}.") from None
        names.append(effect.name)
    return names
