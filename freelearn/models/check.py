"""Whether a model that somebody wrote gives what the chain asks of it, told before a fit begins."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from freelearn.errors import UserError
from freelearn.measurements.states import States
from freelearn.models.base import Model
from freelearn.models.effects.check import ROWS
from freelearn.models.prediction import Prediction


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
            f"{tuple(loads.shape)}: put them side by side with freelearn.models.ports.columns(force, moment)."
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
