"""Recurrences along a log without a loop over its samples: their steps compose, so a tree of compositions does them.

A tree of depth log₂ N computes all N states (Blelloch, Prefix sums and their applications, CMU-CS-90-190, 1990). Of
torch operations alone, so that every derivative follows.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

Steps = tuple[Tensor, ...]


def scanned(compose: Callable[[Steps, Steps], Steps], steps: Steps) -> Steps:
    """The composition of the first 1, 2, …, N steps: each tensor (N, …) → (N, …). compose(earlier, later)."""
    count = steps[0].shape[0]
    if count < 2:
        return steps
    pairs = compose(tuple(s[0 : count - 1 : 2] for s in steps), tuple(s[1::2] for s in steps))
    odd = scanned(compose, pairs)
    if count == 2:
        return tuple(torch.cat([s[:1], o]) for s, o in zip(steps, odd, strict=True))
    before = odd if count % 2 else tuple(o[:-1] for o in odd)
    even = compose(before, tuple(s[2::2] for s in steps))
    return tuple(_woven(torch.cat([s[:1], e]), o) for s, e, o in zip(steps, even, odd, strict=True))


def _woven(even: Tensor, odd: Tensor) -> Tensor:
    """Even and odd places, one after the other."""
    count = odd.shape[0]
    woven = torch.stack([even[:count], odd], dim=1).flatten(0, 1)
    return woven if even.shape[0] == count else torch.cat([woven, even[count:]])


def recurred(factor: Tensor, added: Tensor) -> Tensor:
    """y with yₙ = aₙ yₙ₋₁ + bₙ, y before the first sample 0. a: (N, …), b: as a. a = 0 begins anew.

    >>> recurred(torch.tensor([0.0, 0.5, 0.5]), torch.tensor([8.0, 0.0, 1.0])).tolist()
    [8.0, 4.0, 3.0]
    """
    factor, added = torch.broadcast_tensors(factor, added)

    def compose(one: Steps, two: Steps) -> Steps:
        return one[0] * two[0], two[0] * one[1] + two[1]

    return scanned(compose, (factor, added))[1]


def stopped(signal: Tensor, low: Tensor, high: Tensor) -> Tensor:
    """z with zₙ = min(max(zₙ₋₁ + xₙ − xₙ₋₁, lowₙ), highₙ): the stop operator of a signal x, low ≤ high, (N, …) each.

    low = high begins anew, and does so at the first sample. A clamp after a shift after such a pair is one again.

    >>> z = stopped(torch.tensor([7.0, 10.0, 9.0, 4.0]), *torch.tensor([[0.0, -2.0, -2.0, -2.0], [0.0, 2.0, 2.0, 2.0]]))
    >>> z.tolist()
    [0.0, 2.0, 1.0, -2.0]
    """
    signal, low, high = torch.broadcast_tensors(signal, low, high)
    # Where it was clamped last tells all: from there on z moves with x. So derivatives need no scan.
    with torch.no_grad():
        x, floor, roof = signal.detach(), low.detach(), high.detach()
        z = _clamped(x.diff(dim=0, prepend=x[:1]), floor, roof)
        place = torch.arange(len(x), device=x.device).reshape(-1, *[1] * (x.ndim - 1)).expand_as(x)
        down, up = z <= floor, z >= roof
        last = torch.where(down | up, place, torch.zeros_like(place)).cummax(0).values
    bound = torch.where(down, low, high)
    moved: Tensor = signal - signal.gather(0, last) + bound.gather(0, last)
    return moved


def _clamped(moved: Tensor, low: Tensor, high: Tensor) -> Tensor:
    """z with zₙ = min(max(zₙ₋₁ + dₙ, lowₙ), highₙ), z before the first sample 0."""

    def compose(one: Steps, two: Steps) -> Steps:
        (shift, low, high), (more, floor, roof) = one, two
        return shift + more, _between(low + more, floor, roof), _between(high + more, floor, roof)

    shift, low, high = scanned(compose, (moved, low, high))
    return _between(shift, low, high)


def _between(value: Tensor, low: Tensor, high: Tensor) -> Tensor:
    return torch.minimum(torch.maximum(value, low), high)
