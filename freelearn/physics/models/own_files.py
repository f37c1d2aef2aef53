"""A user's own effects and models: Python files that the environment names."""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from freelearn.common.errors import UserError
from freelearn.physics.chain.effect import Effect
from freelearn.physics.chain.model import Model
from freelearn.physics.effects.registry import EFFECTS, effects_in, register
from freelearn.physics.models.build import MODELS, register_model

# Both name files separated as in PATH, and each may hold effects and models alike.
VARIABLES = ("FREELEARN_EFFECTS", "FREELEARN_MODELS")

# Modules from which users' files, and effects that searches wrote, imported before freelearn.own was there: where they
# are now.
MOVED = {
    "measurements.recording": "data.recordings",
    "measurements.rows": "data.rows",
    "measurements.states": "data.states",
    "mechanics.energy": "physics.mechanics.energy",
    "mechanics.inextensible": "physics.mechanics.inextensible",
    "models.base": "physics.chain.model",
    "models.continuum": "physics.models.continuum",
    "models.effect": "physics.chain.effect",
    "models.lags": "physics.chain.lags",
    "models.material": "physics.chain.material",
    "models.parameter": "physics.chain.parameters",
    "models.parameters": "physics.chain.parameters",
    "models.ports": "physics.chain.ports",
    "models.prediction": "physics.chain.prediction",
}

# Files that have been read, and the names of the effects and models in them.
_READ: dict[Path, list[str]] = {}


def load_own_code() -> list[str]:
    """Registers the effects and models in the files that FREELEARN_EFFECTS and FREELEARN_MODELS name; their names.

    Environment variables and nothing else: no data, configuration or checkpoint can have a file run. Raises UserError.
    """
    return load_own(_named())


def own_files() -> list[Path]:
    """The files that the two variables name, for digests: whole paths, each once, in order. Runs nothing."""
    return list(dict.fromkeys(_path(given) for given in _named()))


def load_own(paths: Sequence[str]) -> list[str]:
    """Registers the effects and models that a user wrote, from Python files named by path; returns their names.

    This runs the files, each once. Call it only with paths that the user typed on the command line or in the
    environment, never with any from data, a checkpoint or a stored configuration. Raises UserError.
    """
    names: list[str] = []
    for given in dict.fromkeys(paths):
        path = _path(given)
        if path not in _READ:
            _READ[path] = _register(_run(path, given), given)
        names += _READ[path]
    return list(dict.fromkeys(names))


def _named() -> list[str]:
    return [path for name in VARIABLES for path in os.environ.get(name, "").split(os.pathsep) if path]


def _path(given: str) -> Path:
    return Path(given).expanduser().resolve()


def _run(path: Path, given: str) -> ModuleType:
    """The file as a module. Raises UserError."""
    if path.suffix != ".py" or not path.is_file():
        raise UserError(
            f"{given} is not a Python file with an effect or a model: give the path of an existing .py file."
        )
    module_name = f"freelearn_own_{len(_READ)}_{path.stem}"
    spec = importlib.util.spec_from_file_location(module_name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    _find_moved(path)
    # Where inspect and pickle look for the source of a class.
    sys.modules[module_name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as problem:
        del sys.modules[module_name]
        reason = f"{type(problem).__name__}: {problem}".splitlines()[0]
        raise UserError(f"{given} does not run ({reason}): mend it and try again.") from problem
    return module


def _find_moved(path: Path) -> None:
    """Makes the modules known by their old names that the file imports from."""
    text = path.read_text(encoding="utf-8", errors="replace")
    for old, new in MOVED.items():
        if re.search(rf"\bfreelearn\.{re.escape(old)}\b", text):
            sys.modules.setdefault(f"freelearn.{old}", importlib.import_module(f"freelearn.{new}"))


def _register(module: ModuleType, given: str) -> list[str]:
    """Names of the module's effects and models, now known; none of them where one is improper. Raises UserError."""
    effects, models = effects_in(module), _models_in(module)
    if not effects and not models:
        raise UserError(
            f"{given} holds no effect and no model: write a class derived from Model or from an effect's base class, "
            "both of freelearn.own, in it."
        )
    names: list[str] = []
    kind: type[Effect[Any]] | type[Model[Any]]
    try:
        for kind in effects:
            what = "an effect"
            register(kind)
            names.append(kind.name)
        for kind in models:
            what = "a model"
            register_model(kind)
            names.append(kind.name)
    except TypeError as problem:
        for name in names:
            EFFECTS.pop(name, None)
            MODELS.pop(name, None)
        raise UserError(f"Class {kind.__name__} in {given} is not {what}: {problem}.") from None
    return names


def _models_in(module: ModuleType) -> list[type[Model[Any]]]:
    """The models that a module defines itself, in the order in which they stand there."""
    classes = [value for value in vars(module).values() if isinstance(value, type) and issubclass(value, Model)]
    return [kind for kind in dict.fromkeys(classes) if kind.__module__ == module.__name__]
