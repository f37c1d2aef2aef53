"""The stop operator of a signal along a log, of several elements at once: what sticks until it slips.

A clamp after a shift after such a pair is one again, so blocks of samples compose (see blocks).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import torch
from torch import Tensor

from freelearn.data.blocks import Blocks, composed

# Which bound an element lay at last, in the two lowest bits of a code; the rest is the sample.
LOW, HIGH = 1, 2


class Spread(NamedTuple):
    """Elements with bounds so many times as large, rᵢ > 0, and the share that each has of what all hold."""

    ratios: tuple[float, ...]
    shares: tuple[float, ...]


def stops(signal: Tensor, low: Tensor, high: Tensor, spread: Spread, anew: Tensor | None) -> Tensor:
    """Sum over elements i of sᵢ zₙ with zₙ = min(max(zₙ₋₁ + xₙ − xₙ₋₁, rᵢ lowₙ), rᵢ highₙ), (N, …).

    signal: x (N, …); low ≤ high, as x, or (1, …) where they stay. spread: the rᵢ and sᵢ. anew: samples that hold
    nothing, (N,) bool; z is 0 before the first sample. Where an element was clamped last tells all: from there on z
    moves with x. So derivatives, forward and backward, are the ones of that; there are no second ones.
    """
    return _applied(_Stops)(signal, low, high, spread, anew)


def _applied(function: type[torch.autograd.Function]) -> Callable[..., Tensor]:
    return function.apply


class _Stops(torch.autograd.Function):
    @staticmethod
    def forward(signal: Tensor, low: Tensor, high: Tensor, spread: Spread, anew: Tensor | None) -> Tensor:
        elements = _Elements(signal, low, high, spread, anew)
        found = elements.blocks.empty(signal, signal.shape[1:])
        for place, at in enumerate(elements.steps()):
            found[place] = elements.summed(at.held)
        return elements.blocks.joined(found)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        *tensors, ctx.spread, anew = inputs
        ctx.save_for_backward(*tensors, anew)
        ctx.save_for_forward(*tensors, anew)
        ctx.set_materialize_grads(False)

    @staticmethod
    def jvp(ctx: Any, signal: Tensor | None, low: Tensor | None, high: Tensor | None, *_: None) -> Tensor:
        *known, anew = ctx.saved_tensors
        return _applied(_Moved)(signal, low, high, *known, ctx.spread, anew)

    @staticmethod
    def backward(ctx: Any, by: Tensor) -> tuple[Tensor | None, ...]:
        signal, low, high, anew = ctx.saved_tensors
        by_signal, by_bounds = by * sum(ctx.spread.shares), [torch.zeros_like(by), torch.zeros_like(by)]
        for ratio, share, code in zip(*ctx.spread, _applied(_Codes)(signal, low, high, ctx.spread, anew), strict=True):
            last, kind = code >> 2, code & 3
            by_signal = by_signal.scatter_add(0, last, -share * by)
            by_bounds = [
                whole.scatter_add(0, last, torch.where(kind == bound, share * ratio * by, 0.0))
                for whole, bound in zip(by_bounds, (LOW, HIGH), strict=True)
            ]
        by_low, by_high = (
            whole.sum_to_size(bound.shape) for whole, bound in zip(by_bounds, (low, high), strict=True)
        )  # fmt: skip
        return by_signal, by_low, by_high, None, None

    @staticmethod
    def vmap(info: Any, where: tuple[Any, ...], *inputs: Any) -> tuple[Tensor, int]:
        signal, *bounds = _side_by_side(where[:3], inputs[:3])
        return _applied(_Stops)(_each(info, signal), *bounds, *inputs[3:]), 1


class _Moved(torch.autograd.Function):
    """What the stops change by where the signal and the bounds change by so much (None: not at all)."""

    @staticmethod
    def forward(
        signal: Tensor | None, low: Tensor | None, high: Tensor | None,
        x: Tensor, floor: Tensor, roof: Tensor, spread: Spread, anew: Tensor | None,
    ) -> Tensor:  # fmt: skip
        elements = _Elements(x, floor, roof, spread, anew)
        blocks, shape = elements.blocks, torch.broadcast_shapes(
            x.shape[1:], *(rate.shape[1:] for rate in (signal, low, high) if rate is not None)
        )  # fmt: skip
        # The last codes alone: those of all samples are as much memory as the elements have states.
        _, last = deque(elements.coded(), maxlen=1).pop()
        last = _into(last)
        along, size = None, elements.size(len(shape))
        rate = x.new_zeros(len(spread.ratios), *shape, blocks.count)
        if signal is not None:
            cut = blocks.cut(signal)
            along = _changes(cut)
            rate += torch.roll(cut[-1], 1, -1) - _picked(signal, last >> 2, shape)
        # Of the bounds, what elements change by that lie at them.
        bounds: list[Tensor | None] = []
        for kind, bound in ((HIGH, high), (LOW, low)):
            if bound is None:
                bounds.append(None)
                continue
            rate += torch.where((last & 3) == kind, size * _picked(bound, last >> 2, shape), 0.0)
            bounds.append(blocks.cut(bound))
        rate[..., 0] = 0
        found, begins = blocks.empty(x, shape), elements.begins
        for place, at in enumerate(elements.steps()):
            if along is not None:
                rate += along[place]
            for bound, clamped in zip(bounds, (at.held >= at.roof, at.held <= at.floor), strict=True):
                if bound is None:
                    rate.masked_fill_(clamped, 0.0)
                else:
                    torch.where(clamped, size * bound[place], rate, out=rate)
            if begins is not None and elements.begun[place]:
                rate.masked_fill_(begins[place], 0.0)
            found[place] = elements.summed(rate)
        return blocks.joined(found)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        pass

    @staticmethod
    def vmap(info: Any, where: tuple[Any, ...], *inputs: Any) -> tuple[Tensor, int]:
        return _applied(_Moved)(*_side_by_side(where[:6], inputs[:6]), *inputs[6:]), 1


class _Codes(torch.autograd.Function):
    """Where each element was clamped last, four times the sample's number and which bound, (elements, N, …) int64.

    Without a clamp so far it counts as at the first sample, at no bound."""

    @staticmethod
    def forward(signal: Tensor, low: Tensor, high: Tensor, spread: Spread, anew: Tensor | None) -> Tensor:
        elements = _Elements(signal, low, high, spread, anew)
        found = elements.blocks.empty(signal, (len(spread.ratios), *signal.shape[1:]), torch.int64)
        for place, (_, code) in enumerate(elements.coded()):
            found[place] = code
        # What was before a block's first clamp lies in the blocks before it.
        return elements.blocks.joined(torch.maximum(found, _into(found[-1]))).movedim(1, 0)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        ctx.mark_non_differentiable(output)

    @staticmethod
    def vmap(info: Any, where: tuple[Any, ...], *inputs: Any) -> tuple[Tensor, int]:
        signal, *bounds = _side_by_side(where[:3], inputs[:3])
        return _applied(_Codes)(_each(info, signal), *bounds, *inputs[3:]), 2


def _side_by_side(where: Sequence[int | None], tensors: Sequence[Tensor | None]) -> list[Tensor | None]:
    """What is batched as one more dimension after the samples, and room for it in the others."""
    return [
        None if x is None else x.unsqueeze(1) if at is None else x.movedim(at, 1)
        for x, at in zip(tensors, where, strict=True)
    ]


def _each(info: Any, signal: Tensor | None) -> Tensor:
    """A signal that every member of a batch has for itself."""
    assert signal is not None
    return signal.expand(-1, info.batch_size, *signal.shape[2:])


def _into(code: Tensor) -> Tensor:
    """What comes into each block, from the codes that the blocks by themselves end with (−1: none), (…, blocks)."""
    into = code.cummax(-1).values.roll(1, -1)
    into[..., 0] = 0
    return into.clamp_min_(0)


def _picked(values: Tensor, sample: Tensor, shape: Sequence[int]) -> Tensor:
    """Values (N, …) at samples (elements, …, blocks), as (elements, *shape, blocks); those of one sample are all's."""
    values, count = values.movedim(0, -1), sample.shape[-1]
    if values.shape[-1] == 1:
        return values
    whole = values.expand(len(sample), *shape, -1)
    return whole.gather(-1, sample.expand(len(sample), *shape, count))


def _changes(cut: Tensor) -> Tensor:
    """By how much a signal, cut (length, …, blocks), has changed since the last sample; nothing at the first."""
    found = torch.empty_like(cut)
    torch.sub(cut[1:], cut[:-1], out=found[1:])
    torch.sub(cut[0, ..., 1:], cut[-1, ..., :-1], out=found[0, ..., 1:])
    found[0, ..., 0] = 0
    return found


class _Step(NamedTuple):
    """What the elements hold back at one sample of every block, and their bounds: (elements, …, blocks)."""

    held: Tensor
    floor: Tensor
    roof: Tensor


class _Elements:
    """The elements along a log that is cut into blocks."""

    def __init__(self, signal: Tensor, low: Tensor, high: Tensor, spread: Spread, anew: Tensor | None) -> None:
        """As `stops`."""
        self.blocks, self.ratios = Blocks(len(signal)), spread.ratios
        self.x = self.blocks.cut(signal)
        self.shares = torch.tensor(spread.shares, dtype=self.x.dtype, device=self.x.device)
        self.changes = _changes(self.x)
        self._size = self.size(signal.ndim - 1)
        self._cut = [self.blocks.cut(bound) for bound in (low, high)]
        # Bounds that stay are made once.
        pairs = zip((low, high), self._cut, strict=True)
        self._stay = [self._size * cut[0] if len(bound) < self.blocks.samples else None for bound, cut in pairs]
        # Samples that hold nothing (length, blocks), and whether there are any at a place.
        self.begins = None if anew is None else self.blocks.cut(anew)
        self.begun: list[bool] = [] if self.begins is None else self.begins.any(1).tolist()

    def size(self, columns: int) -> Tensor:
        """The ratios, to multiply what has so many dimensions between elements and blocks."""
        return torch.tensor(self.ratios, dtype=self.x.dtype, device=self.x.device).reshape(-1, *[1] * (columns + 1))

    def summed(self, held: Tensor) -> Tensor:
        """What all hold of what each does, (elements, …)."""
        total: Tensor = torch.tensordot(self.shares, held, 1)
        return total

    def steps(self) -> Iterator[_Step]:
        """One sample of every block after the other; the next one overwrites what is held."""
        return self._steps(self.into.clone())

    def _steps(self, held: Tensor) -> Iterator[_Step]:
        for place in range(self.blocks.length):
            floor, roof = (
                self._size * cut[place] if stay is None else stay
                for stay, cut in zip(self._stay, self._cut, strict=True)
            )  # fmt: skip
            torch.clamp(held.add_(self.changes[place]), floor, roof, out=held)
            if self.begins is not None and self.begun[place]:
                held.masked_fill_(self.begins[place], 0.0)
            yield _Step(held, floor, roof)

    @cached_property
    def into(self) -> Tensor:
        """What is held as each block begins, (elements, …, blocks)."""
        # What a block makes of the least and of the most that may come into it bounds what it makes of anything.
        extremes = self.x.new_full((2, len(self.ratios), *self.x.shape[1:]), torch.inf)
        extremes[0] = -torch.inf
        for _ in self._steps(extremes):
            pass
        ended = self.x[-1]
        _, low, high = composed(_after, (ended, *extremes))
        into = torch.clamp(ended - self.x[0, ..., :1], low, high).roll(1, -1)
        into[..., 0] = 0
        return into

    def coded(self) -> Iterator[tuple[_Step, Tensor]]:
        """The steps, and where in its block each element was clamped last: as _Codes, −1 if not yet."""
        sample = self.blocks.length * torch.arange(self.blocks.count, device=self.x.device)
        code = torch.full_like(self.into, -1, dtype=torch.int64)
        for place, at in enumerate(self.steps()):
            here = 4 * (sample + place)
            code = torch.where(at.held >= at.roof, here + HIGH, code)
            code = torch.where(at.held <= at.floor, here + LOW, code)
            if self.begins is not None and self.begun[place]:
                code = torch.where(self.begins[place], here, code)
            yield at, code


def _after(one: tuple[Tensor, ...], two: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
    """Of two blocks together: x at the last sample, and the bounds that they put."""
    (x, low, high), (end, floor, roof) = one, two
    shift = end - x
    return end, torch.clamp(low + shift, floor, roof), torch.clamp(high + shift, floor, roof)
