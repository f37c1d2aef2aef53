"""Derivatives of a function of whose rows none depends on another, and two linear equations in every row."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from freelearn.common.vmapped import indices_if_known
from freelearn.physics.chain.prediction import Prediction

# Derivatives of a function of whose rows none depends on another.


def rows_jacobian(f: Callable[[Tensor], Tensor], x: Tensor, doubled: int = 0) -> tuple[Tensor, Tensor]:
    """f(x) and its derivative row by row, cut from every derivative: x (N, k), f (N, 2) → (N, 2), (N, 2, k).

    No row depends on another, so two reverse passes give all of it, at a fifth of the time of forward mode. doubled:
    of how many blocks each is the same rows twice (States.doubled); then one pass does.
    """
    inputs = _leaf(x)
    if inputs is None:  # torch.func must do it
        value, pull = torch.func.vjp(f, x)  # type: ignore[misc]
        unit = torch.eye(2, dtype=x.dtype, device=x.device)
        return value, torch.stack([pull(unit[i].expand_as(value))[0] for i in (0, 1)], dim=-2)
    # torch.func's reverse mode imports torch's compiler when first used, which takes two seconds.
    with torch.enable_grad():
        value = f(inputs)
        rate = _rate(value, inputs, doubled)
    return value.detach(), rate


def recorded_with_rate(f: Callable[[Tensor], Prediction], x: Tensor, doubled: int = 0) -> tuple[Prediction, Tensor]:
    """f(x), recorded for derivatives by all else that it depends on, and its loads' derivative by x, cut from every
    derivative: x (N, k) → (N, 2), (N, 2, k). What is recorded serves both. doubled: as rows_jacobian has it."""
    inputs = _leaf(x)
    if inputs is not None:
        found = f(inputs)
        # Inside torch.func's reverse mode nothing is recorded by a leaf.
        if found.loads.requires_grad and found.loads.grad_fn is not None:
            return found, _rate(found.loads, inputs, doubled)
    return f(x), rows_jacobian(lambda at: f(at).loads, x, doubled)[1]


def _leaf(x: Tensor) -> Tensor | None:
    """x (N, k) cut from every derivative, to take derivatives by; None inside vmap or forward mode."""
    try:
        return x.detach().requires_grad_()
    except RuntimeError:
        return None


def _rate(value: Tensor, by: Tensor, doubled: int) -> Tensor:
    """Derivative (N, 2, k) of a value (N, 2), recorded already, by a leaf (N, k); the record stays."""
    if doubled:
        # Of the one half of a block the first is asked, of the other the second.
        each = value.reshape(doubled, 2, -1, 2)
        asked = each[:, 0, :, 0].sum() + each[:, 1, :, 1].sum()
        found = torch.autograd.grad(asked, by, retain_graph=True, materialize_grads=True)[0]
        both = found.view(doubled, 2, -1, 1, by.shape[1]).transpose(1, 3)
        return both.expand(-1, 2, -1, -1, -1).reshape(len(by), 2, -1)
    rates = [torch.autograd.grad(value[:, i].sum(), by, retain_graph=True, materialize_grads=True)[0] for i in (0, 1)]
    return torch.stack(rates, dim=-2)


# The square of a step that is none.
SMALLEST = 1e-30


def determinant(m: Tensor) -> Tensor:
    """Of every row: (N, 2, 2) → (N,)."""
    return m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0]


def divide(g: Tensor, m: Tensor) -> Tensor:
    """m⁻¹ g of every row: (N, 2), (N, 2, 2) → (N, 2)."""
    first = m[:, 1, 1] * g[:, 0] - m[:, 0, 1] * g[:, 1]
    second = m[:, 0, 0] * g[:, 1] - m[:, 1, 0] * g[:, 0]
    return torch.stack([first, second], dim=-1) / determinant(m)[:, None]


def mended(slope: Tensor, change: Tensor, step: Tensor, size: Tensor) -> Tensor:
    """A slope (N, 2, 2) that gives the change (N, 2) seen along a step (N, 2), and is as it was across: Broyden (1965).

    size: what counts as one of either quantity, (N, 2)."""
    lacking = change - (slope * step[:, None, :]).sum(-1)
    along = step / size**2
    reach = (along * step).sum(-1).clamp_min(SMALLEST)
    return slope + lacking[:, :, None] * (along / reach[:, None])[:, None, :]


# Steps with the slope of a place nearby, before derivatives are taken, which cost three times as much a step; after so
# many of them a few rows that have not settled, a share, are not waited for.
CHORDS, PATIENT, FEW = 10, 5, 0.1
# A step is of the order of what is left, of which the differentiable step, with the slope there, leaves the square.
CHORD_TOLERANCE = 1e-9


def enough(settled: Tensor, turn: int) -> bool:
    """Whether as many rows have settled, (N,) bool, as are waited for in this turn; False inside vmap."""
    left = indices_if_known(~settled)
    return left is not None and len(left) <= (FEW * len(settled) if turn >= PATIENT else 0)
