"""A user's own code, in the files that the environment names."""

from __future__ import annotations

import os
from pathlib import Path

from freelearn.models.base import Model
from freelearn.models.effects.registry import load_own


def own_files() -> list[Path]:
    """The files that FREELEARN_EFFECTS and FREELEARN_MODELS name, separated as in PATH."""
    named = [os.environ.get(name, "") for name in ("FREELEARN_EFFECTS", "FREELEARN_MODELS")]
    return [Path(path) for paths in named for path in paths.split(os.pathsep) if path]


def load_own_code() -> None:
    """Registers the effects and models in those files; no data, configuration or checkpoint can have a file run.

    Raises UserError.
    """
    load_own([str(path) for path in own_files()])


def own_models() -> list[type[Model]]:
    """The user's own models."""
    return []
