"""Gradients of numbers by torch's recorded reverse mode, where that can be: torch.func's, and that of anything but one
number, load a compiler when they are first used, which takes seconds."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

Tensors = tuple[Tensor, ...]


def gradient(total: Callable[..., Tensor], *at: Tensor) -> Tensors:
    """∂total/∂at of a function of tensors whose value is one number, differentiable by all that it depends on.

    >>> gradient(lambda x: (x**3).sum(), torch.tensor([1.0, 2.0]))
    (tensor([ 3., 12.]),)
    """
    apart = _apart(at)
    if apart is None:
        found: Tensors = torch.func.grad(total, argnums=tuple(range(len(at))))(*at)
        return found
    recorded = torch.is_grad_enabled() and _hangs_on_more(lambda *x: (total(*x),), at)
    with torch.enable_grad():
        by = torch.autograd.grad(total(*apart), apart, create_graph=recorded, materialize_grads=True)
    return by if recorded else tuple(each.detach() for each in by)


def along(function: Callable[..., Tensors], at: Tensors, rates: Tensors) -> tuple[Tensors, Tensors]:
    """function(at), a gradient, and its derivative along `rates`: second derivatives are symmetric, so the reverse
    product is the forward one, several times quicker."""
    apart = _apart(at)
    if apart is None:
        value, pull = torch.func.vjp(function, *at)  # type: ignore[misc]
        return value, pull(tuple(rate.expand_as(v) for rate, v in zip(rates, value, strict=True)))
    recorded = torch.is_grad_enabled() and _hangs_on_more(function, at)
    with torch.enable_grad():
        value = function(*apart)
        weighed = [(v * rate).sum() for v, rate in zip(value, rates, strict=True) if v.requires_grad]
        if not weighed:
            return tuple(v.detach() for v in value), tuple(torch.zeros_like(x) for x in at)
        by = torch.autograd.grad(torch.stack(weighed).sum(), apart, create_graph=recorded, materialize_grads=True)
    return (value, by) if recorded else (tuple(v.detach() for v in value), tuple(each.detach() for each in by))


def _hangs_on_more(function: Callable[..., Tensors], at: Sequence[Tensor]) -> bool:
    """Whether a derivative may be asked by what the tensors, or else the function, are made of."""
    return any(x.requires_grad for x in at) or any(value.requires_grad for value in function(*at))


def _apart(at: Sequence[Tensor]) -> Tensors | None:
    """The tensors as such of which none is made of another; None inside torch.func, which must do it itself."""
    try:
        with torch.enable_grad():
            return tuple(x.view_as(x) if x.requires_grad else x.detach().requires_grad_() for x in at)
    except RuntimeError:
        return None
