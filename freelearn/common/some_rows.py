"""Some of the rows of a thing that is made of tensors, of which the last dimension goes over rows or has none."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, TypeVar

from torch import Tensor

T = TypeVar("T")


def some_rows(value: T, rows: Tensor, count: int) -> T:
    """A tensor, a tuple of such things, or what has some rows of its own; anything else as it is.

    rows: (n,) int64, of so many.

    >>> import torch
    >>> some_rows((torch.arange(6).reshape(2, 3), torch.tensor(7)), torch.tensor([2]), 3)
    (tensor([[2],
            [5]]), tensor(7))
    """
    found: Any = value
    if isinstance(value, Tensor):
        found = value[..., rows] if value.ndim and value.shape[-1] == count else value
    elif isinstance(value, tuple):
        found = tuple(some_rows(part, rows, count) for part in value)
    elif hasattr(value, "some"):
        found = value.some(rows, count)
    return found  # type: ignore[no-any-return]


class InRows:
    """Base of dataclasses of such things."""

    def some(self: T, rows: Tensor, count: int) -> T:
        """The same of some of so many rows, (n,) int64."""
        chosen: Any = self
        own = {f.name: some_rows(getattr(self, f.name), rows, count) for f in fields(chosen)}
        return replace(chosen, **own)  # type: ignore[no-any-return]
