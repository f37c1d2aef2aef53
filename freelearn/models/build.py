"""Models by name, from configurations and from checkpoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import torch

from freelearn.errors import UserError
from freelearn.files import write_whole
from freelearn.models.base import Model
from freelearn.models.continuum import Continuum
from freelearn.models.effects.registry import make_effects
from freelearn.models.linear import Linear
from freelearn.models.mlp import MLP
from freelearn.models.variants import ContinuumInextensible, ContinuumLinearMaterial, ContinuumThinWall

VARIANTS = (ContinuumLinearMaterial, ContinuumThinWall, ContinuumInextensible)
MODELS: dict[str, type[Model]] = {model.name: model for model in (Continuum, Linear, MLP, *VARIANTS)}


def build_model(
    name: str,
    values: Mapping[str, float] | None = None,
    effects: Sequence[str] = (),
    samples: Sequence[int] | None = None,
) -> Model:
    """A model with its parameters' start values (SI) and effects. Raises UserError for unknown names or values.

    samples: those of the training set. With several, what is set by building or mounting a sample has one parameter
    for each of them.
    """
    if name not in MODELS:
        raise UserError(f"Unknown model {name!r}: choose one of {', '.join(MODELS)}.")
    kind = MODELS[name]
    model = kind(effects=make_effects(effects, kind.family, samples or ()))  # type: ignore[call-arg]
    model.set_values(values or {})
    return model


def save_checkpoint(model: Model, path: Path) -> None:
    """Writes a fitted model so that `load_model` and `torch.load(weights_only=True)` read it; whole or not at all."""
    write_whole(path, lambda beside: torch.save({"freelearn": model.description()}, beside))


def load_model(path: str | Path) -> Model:
    """A fitted model from a run's checkpoint.ckpt. Executes nothing from the file. Raises UserError."""
    try:
        content = torch.load(path, weights_only=True)["freelearn"]
    except FileNotFoundError:
        raise UserError(f"No checkpoint at {path}.") from None
    except Exception as problem:
        raise UserError(f"{path} is not a freelearn checkpoint: {problem}".split("\n")[0]) from None
    model = build_model(content["model"], effects=content["effects"], samples=content.get("samples"))
    model.load_state_dict(content["state"])
    return model
