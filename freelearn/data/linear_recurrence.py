"""A linear recurrence along a log: yₙ = aₙ yₙ₋₁ + bₙ, whose derivatives are recurrences with the same factors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

from freelearn.data.blocks import Blocks, composed


def linear_recurrence(factor: Tensor, added: Tensor) -> Tensor:
    """y with yₙ = aₙ yₙ₋₁ + bₙ, y before the first sample 0. a, b: (N, …), each 1 or as the other in what follows N."""
    of: Callable[..., Tensor] = _LinearRecurrence.apply
    return of(factor, added)


class _LinearRecurrence(torch.autograd.Function):
    @staticmethod
    def forward(factor: Tensor, added: Tensor) -> Tensor:
        blocks, shape = Blocks(len(added)), torch.broadcast_shapes(factor.shape[1:], added.shape[1:])
        a, b = blocks.cut(factor), blocks.cut(added)
        # From nothing, and what is left of whatever comes into a block.
        y, left = added.new_zeros(*shape, blocks.count), torch.ones_like(a[0])
        for place in range(blocks.length):
            torch.addcmul(b[place], a[place], y, out=y)
            left *= a[place]
        y = torch.roll(composed(_after, (left, y))[1], 1, -1)
        y[..., 0] = 0
        found = blocks.empty(added, shape)
        for place in range(blocks.length):
            y = torch.addcmul(b[place], a[place], y, out=found[place])
        return blocks.joined(found)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Tensor, Tensor], output: Tensor) -> None:
        factor, added = inputs
        ctx.save_for_backward(factor, added, output)
        ctx.save_for_forward(factor, added, output)
        ctx.set_materialize_grads(False)

    @staticmethod
    def jvp(ctx: Any, factor: Tensor | None, added: Tensor | None) -> Tensor:
        a, _, y = ctx.saved_tensors
        if factor is None:
            assert added is not None
            # All of y's columns may feel what moves them all.
            return linear_recurrence(a, added.expand_as(y))
        moved = factor * _before(y)
        return linear_recurrence(a, moved if added is None else moved + added)

    @staticmethod
    def backward(ctx: Any, by: Tensor) -> tuple[Tensor | None, Tensor | None]:
        a, b, y = ctx.saved_tensors
        after = torch.cat([a[1:], torch.zeros_like(a[:1])])
        whole = linear_recurrence(after.flip(0), by.flip(0)).flip(0)
        factor = (whole * _before(y)).sum_to_size(a.shape) if ctx.needs_input_grad[0] else None
        return factor, whole.sum_to_size(b.shape) if ctx.needs_input_grad[1] else None

    @staticmethod
    def vmap(info: Any, where: tuple[int | None, int | None], factor: Tensor, added: Tensor) -> tuple[Tensor, int]:
        pairs = zip((factor, added), where, strict=True)
        a, b = (x.unsqueeze(1) if at is None else x.movedim(at, 1) for x, at in pairs)
        return linear_recurrence(a, b), 1


def _before(y: Tensor) -> Tensor:
    """y of the sample before, zero before the first."""
    return torch.cat([torch.zeros_like(y[:1]), y[:-1]])


def _after(one: tuple[Tensor, ...], two: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
    """Of two blocks together: what is left of what comes in, and where they end from nothing."""
    return two[0] * one[0], torch.addcmul(two[1], two[0], one[1])
