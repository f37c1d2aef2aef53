"""Loops that run a fixed number of times, as a trace sees them: their body once, between two marks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

_LIBRARY = torch.library.Library("freelearn_export", "DEF")
_LIBRARY.define("begin(Tensor[] start) -> Tensor[]")
_LIBRARY.define("end(Tensor[] carried, Tensor[] next, int times) -> Tensor[]")


def _begin(start: Sequence[Tensor]) -> list[Tensor]:
    return [t.clone() for t in start]


def _end(carried: Sequence[Tensor], next: Sequence[Tensor], times: int) -> list[Tensor]:
    return [t.clone() for t in next]


_LIBRARY.impl("begin", _begin, "CompositeExplicitAutograd")
_LIBRARY.impl("end", _end, "CompositeExplicitAutograd")
BEGIN, END = torch.ops.freelearn_export.begin.default, torch.ops.freelearn_export.end.default


def repeated(
    turn: Callable[[list[Tensor]], Sequence[Tensor]], start: Sequence[Tensor], times: int
) -> list[Tensor]:  # fmt: skip
    """What start becomes after so many turns: inside of a trace, where one turn stands for all.

    turn: from what is carried to what it becomes, tensors of the same shapes."""
    carried = BEGIN([t.detach() for t in start])
    following = [n.expand_as(c) for n, c in zip(turn(list(carried)), carried, strict=True)]
    ended: list[Tensor] = END(carried, following, times)
    return ended
