"""Any optimizer of torch.optim by its name, if it treats every number by itself."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Mapping

import torch
from torch import Tensor

from freelearn.common.errors import UserError
from freelearn.fitting.options import Option

# A try-out of two restarts: numbers each, and steps.
_SIZE, _STEPS = 3, 3


def optimizer_names() -> list[str]:
    """The optimizers that torch.optim offers, as they are written in a configuration: adam, adamw, …"""
    return sorted(name.lower() for name in _classes())


def make_optimizer(name: str, parameter: Tensor, options: Mapping[str, Option]) -> torch.optim.Optimizer:
    """The optimizer called `name` (upper or lower case) over the rows of `parameter`, (members, p).

    Restarts stand side by side in one tensor, so only an optimizer that acts number by number will do. Raises UserError
    for an unknown name, an option that the optimizer does not take, and one that couples the restarts.
    """
    classes = {known.lower(): kind for known, kind in _classes().items()}
    if name.lower() not in classes:
        close = difflib.get_close_matches(name.lower(), classes, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        known = ", ".join(["levenberg_marquardt", "none", *classes])
        raise UserError(f"Unknown fit {name!r}.{hint} Choose one of {known}.")
    kind = classes[name.lower()]
    offered = list(inspect.signature(kind).parameters)[1:]
    if unknown := sorted(set(options) - set(offered)):
        raise UserError(f"fit={name} takes no option {', '.join(unknown)}: choose from {', '.join(offered)}.")
    _check_apart(name, kind, options)
    return _built(name, kind, parameter, options)


def _classes() -> dict[str, type[torch.optim.Optimizer]]:
    optimizers: dict[str, type[torch.optim.Optimizer]] = {}
    for name in dir(torch.optim):
        kind = getattr(torch.optim, name)
        if isinstance(kind, type) and issubclass(kind, torch.optim.Optimizer) and kind is not torch.optim.Optimizer:
            optimizers[name] = kind
    return optimizers


def _built(
    name: str, kind: type[torch.optim.Optimizer], parameter: Tensor, options: Mapping[str, Option]
) -> torch.optim.Optimizer:
    make: Callable[..., torch.optim.Optimizer] = kind
    try:
        return make([parameter], **options)
    except (TypeError, ValueError) as error:
        chosen = ", ".join(f"{option}={value}" for option, value in options.items())
        raise UserError(f"fit={name} does not work with {chosen}: {error}") from error


def _check_apart(name: str, kind: type[torch.optim.Optimizer], options: Mapping[str, Option]) -> None:
    """Raises UserError where a restart's steps depend on another's gradient: tried out on a tensor of two."""
    ends = []
    for other in (1.0, 1e3):
        parameter = torch.ones(2, _SIZE, dtype=torch.float64, requires_grad=True)
        optimizer = _built(name, kind, parameter, options)
        try:
            for step in range(1, _STEPS + 1):
                one = torch.linspace(1, 1 + step, _SIZE, dtype=torch.float64)
                parameter.grad = torch.stack([one, other * one.flip(0)])
                optimizer.step()
        except (TypeError, ValueError, RuntimeError):
            # It wants a closure (LBFGS) or gradients of another kind (SparseAdam).
            ends = [parameter.new_zeros(()), parameter.new_ones(())]
            break
        ends.append(parameter.detach()[0])
    if not torch.equal(*ends):
        raise UserError(
            f"fit={name} cannot fit restarts side by side, since it does not treat every number by itself: "
            "choose another optimizer, such as adam."
        )
