"""Models by name, from configurations and checkpoints, and whether one that somebody wrote does what it must."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.common.files import write_bytes
from freelearn.data.states import States
from freelearn.physics.chain.chain import Chain
from freelearn.physics.chain.effect import FAMILIES
from freelearn.physics.chain.known_parameters import Known
from freelearn.physics.chain.model import Model
from freelearn.physics.chain.parameters import misnamed
from freelearn.physics.chain.prediction import Prediction
from freelearn.physics.effects.effect_check import ROWS
from freelearn.physics.effects.registry import make_effects
from freelearn.physics.models.continuum import (
    Continuum,
    ContinuumInextensible,
    ContinuumLinearMaterial,
    ContinuumThinWall,
)
from freelearn.physics.models.hybrid import Hybrid
from freelearn.physics.models.linear import Linear
from freelearn.physics.models.mlp import MLP

# Models by name, from configurations and from checkpoints.

VARIANTS = (ContinuumLinearMaterial, ContinuumThinWall, ContinuumInextensible)
MODELS: dict[str, type[Model[Any]]] = {model.name: model for model in (Continuum, Linear, MLP, Hybrid, *VARIANTS)}


def register_model(model: type[Model[Any]]) -> None:
    """Makes a model known by its name. Raises TypeError where its class is not a proper model."""
    name = getattr(model, "name", None)
    if not isinstance(name, str) or not name.isidentifier():
        raise TypeError(f"its name {name!r} is not a word of letters, digits and underscores")
    if name in MODELS:
        raise TypeError(f"its name {name!r} is taken")
    if model.family not in FAMILIES:
        raise TypeError(f"its family {model.family!r} is none of {', '.join(FAMILIES)}")
    if model.structure is Model.structure and model.bare in (Model.bare, Chain.bare):
        raise TypeError("it must write the method structure")
    if wrong := misnamed(model, model.parameter_class):
        raise TypeError(wrong)
    for p in model.parameter_class.records():
        if not p.allows(p.start):
            raise TypeError(f"the start of its parameter {p.name!r} must lie within its bounds")
    MODELS[name] = model


def build_model(
    name: str,
    values: Mapping[str, float] | None = None,
    effects: Sequence[str] = (),
    samples: Sequence[int] | None = None,
    members: int = 0,
    known: Known | None = None,
) -> Model[Any]:
    """A model with its parameters' start values (SI) and effects. Raises UserError for unknown names or values.

    samples: those of the training set. With several, what is set by building or mounting a sample has one parameter
    for each of them. members: how many actuators share an end block, none for one alone; what is each one's own then
    has a parameter for each. known: what is known of parameters beforehand.
    """
    if name not in MODELS:
        raise UserError(
            f"Unknown model {name!r}: choose one of {', '.join(MODELS)}. "
            "If it is your own, name its file in FREELEARN_MODELS."
        )
    kind = MODELS[name]
    model = kind(effects=make_effects(effects, kind.family, samples or (), name, members))
    if values:
        model.set_values(values)
    model.learn(known or Known())
    return model


def save_checkpoint(model: Model[Any], path: Path) -> None:
    """Writes a fitted model so that `load_model` and `torch.load(weights_only=True)` read it; whole or not at all."""
    # Not straight into the file: its name would get into the content, and a full disk is no OSError of torch's.
    content, known = BytesIO(), model.description()
    torch.save({"freelearn": known | {"digest": _digest(known)}}, content)
    write_bytes(path, content.getvalue())


def load_model(path: str | Path) -> Model[Any]:
    """A fitted model from a run's checkpoint.ckpt. Executes nothing from the file. Raises UserError."""
    try:
        content = dict(torch.load(path, weights_only=True)["freelearn"])
        # torch reads a number that was changed on the disk like any other.
        if content.pop("digest", None) not in (None, _digest(content)):
            raise ValueError("it is not as it was written")
        known: dict[str, Any] = {name: content.get(name) for name in ("effects", "samples")}
        model = build_model(content["model"], **known, members=content.get("members", 0))
        # First, because what was known held before the fit.
        model.learn(Known.from_plain(content.get("known", {})))
        state = content["state"]
        model.load_state_dict(state if content.get("raw_form", 1) == model.raw_form else model.from_older(state))
    except UserError:
        raise
    except FileNotFoundError:
        raise UserError(f"No checkpoint at {path}.") from None
    except Exception as problem:
        raise UserError(f"{path} is not a freelearn checkpoint: {problem}".split("\n")[0]) from None
    return model


def _digest(description: Mapping[str, Any]) -> str:
    """Of a model's description but for a digest in it."""
    digest = hashlib.sha256(repr([(k, description[k]) for k in sorted(description) if k != "state"]).encode())
    for name, tensor in sorted(description["state"].items()):
        digest.update(repr((name, tensor.dtype, tuple(tensor.shape))).encode() + tensor.contiguous().numpy().tobytes())
    return digest.hexdigest()


# Whether a model that somebody wrote gives what the chain asks of it, told before a fit begins.


def check_model(model: Model[Any], states: States) -> None:
    """Calls the model's own method on a few rows, and takes its derivative there.

    Raises UserError where it fails, returns anything but loads of shape (N, 2), numbers that are finite in no row, or
    loads through which no derivative by its parameters passes.
    """
    few = states[: min(ROWS, len(states))]
    method = "structure" if type(model).bare is Model.bare else "bare"
    said = f"Model {model.name!r}: its {method}"
    vector = model.vector().detach().requires_grad_()
    try:
        with torch.enable_grad():
            values = model.physical(vector)
            # `bare` of the base class would hide what is not finite.
            returned = model.structure(few, model.own(values)) if method == "structure" else model.bare(few, values)
    except Exception as problem:
        raise UserError(f"{said} failed with {type(problem).__name__}: {problem}".splitlines()[0]) from None
    loads: object = returned.loads if isinstance(returned, Prediction) else returned
    if not isinstance(loads, Tensor):
        raise UserError(f"{said} must return loads as a tensor, or a Prediction, not {type(loads).__name__}.")
    if tuple(loads.shape) != (len(few), 2):
        raise UserError(
            f"{said} must return loads of shape {(len(few), 2)}, force and moment of each row, not of shape "
            f"{tuple(loads.shape)}: put them side by side with freelearn.physics.chain.ports.columns(force, moment)."
        )
    if loads.dtype != torch.float64:
        raise UserError(f"{said} must return float64, not {str(loads.dtype).removeprefix('torch.')}.")
    finite = loads.isfinite().all(-1)
    if not bool(finite.any()):
        raise UserError(f"{said} returns loads that are not finite at ordinary states.")
    if len(model.parameter_class.records()) and not loads.requires_grad:
        raise UserError(
            f"{said} does not depend on its parameters in a way that can be differentiated: "
            "write it with torch operations on p, without float(…), .item() or .detach()."
        )
