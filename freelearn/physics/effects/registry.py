"""The effects that a configuration may name: every module of this package that holds one, and a user's own."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from freelearn.common.errors import UserError
from freelearn.physics import effects as library
from freelearn.physics.chain.effect import PORTS, Effect
from freelearn.physics.chain.ports import BASES
from freelearn.physics.effects.names import unknown_effect

# In the order in which they act, within each port.
EFFECTS: dict[str, type[Effect[Any]]] = {}

# What each port's base classes ask to be written.
METHODS = {base.method for base in BASES}


def register(effect: type[Effect[Any]]) -> None:
    """Makes an effect known by its name. Raises TypeError where its class is not a proper effect."""
    name = getattr(effect, "name", None)
    if not isinstance(name, str) or not name.isidentifier():
        raise TypeError(f"its name {name!r} is not a word of letters, digits and underscores")
    if name in EFFECTS:
        raise TypeError(f"its name {name!r} is taken")
    wrong = _plug(effect) or effect.problem()
    if wrong:
        raise TypeError(wrong)
    EFFECTS[name] = effect


@contextmanager
def lent(effects: Iterable[type[Effect[Any]]]) -> Iterator[None]:
    """Makes effects known for a while: those that a search tries, and has written itself. Raises TypeError."""
    names = []
    try:
        for effect in effects:
            if EFFECTS.get(effect.name) is not effect:
                register(effect)
                names.append(effect.name)
        yield
    finally:
        for name in names:
            EFFECTS.pop(name, None)


def _plug(effect: type[Effect[Any]]) -> str | None:
    """What is wrong with how the class plugs into the chain; None where it is proper."""
    bases = [base for base in BASES if issubclass(effect, base)]
    if len(bases) != 1:
        known = ", ".join(base.__name__ for base in BASES)
        return f"it must derive from exactly one of {known}"
    method = bases[0].method
    if getattr(effect, method) is getattr(bases[0], method):
        return f"it must write the method {method} of {bases[0].__name__}"
    more = [name for name in METHODS - {method} if hasattr(effect, name)]
    if more:
        return f"it writes {method} and {', '.join(sorted(more))}, which belong to different ports: make two effects"
    return None


def _discover() -> list[type[Effect[Any]]]:
    """The effects in this package's modules, by port, place and name."""
    classes = []
    for module in pkgutil.walk_packages(library.__path__, f"{library.__name__}."):
        # This module is one of them, and not yet whole.
        if module.name != __name__:
            classes += effects_in(importlib.import_module(module.name))
    return sorted(classes, key=lambda effect: (PORTS.index(effect.port), effect.place, effect.name))


def effects_in(module: Any) -> list[type[Effect[Any]]]:
    """The effects that a module defines itself, in the order in which they stand there."""
    classes = [value for value in vars(module).values() if isinstance(value, type) and issubclass(value, Effect)]
    return [kind for kind in dict.fromkeys(classes) if kind.__module__ == module.__name__]


for _effect in _discover():
    register(_effect)


def make_effects(
    names: Sequence[str], family: str, samples: Sequence[int] = (), model: str | None = None, members: int = 0
) -> list[Effect[Any]]:
    """The named effects for a family of models, in the order of the registry whatever the order of the names.

    samples: those of the training set; with several, some parameters have one value for each; members: how many
    actuators share an end block (see Effect). model: what a message calls it. Raises UserError for what is unknown or
    does not fit.
    """
    for i, name in enumerate(names):
        if name not in EFFECTS:
            raise unknown_effect(name, EFFECTS)
        if name in names[:i]:
            raise UserError(f"Effect {name!r} is named twice: name it once.")
        if family not in EFFECTS[name].families():
            fits = ", ".join(EFFECTS[name].families())
            raise UserError(f"Effect {name!r} cannot join model {model or family!r}: it works with {fits}.")
    return [effect(samples, members) for name, effect in EFFECTS.items() if name in names]


def missing_columns(effects: Iterable[Effect[Any]], table_columns: Iterable[str]) -> str | None:
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
