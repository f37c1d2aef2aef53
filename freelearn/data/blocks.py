"""A log cut into blocks that stand side by side, so that a recurrence takes all of them one sample further at once.

What each block makes of whatever comes into it composes, from which follows what does come in; then all samples do. One
step of all blocks fits the processor's cache, where a tree over the samples reads and writes memory at every depth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

# Blocks that stand side by side.
BLOCKS = 2048


class Blocks:
    """N samples as blocks of equal length: (N, …) ↔ (length, …, count).

    length: samples of a block; count: of blocks. The last block is filled up with the last sample."""

    def __init__(self, samples: int) -> None:
        self.samples = samples
        self.length = max(1, -(-samples // BLOCKS))
        self.count = max(1, -(-samples // self.length))

    def empty(self, like: Tensor, shape: Sequence[int], dtype: torch.dtype | None = None) -> Tensor:
        """Room for what (N, *shape) becomes."""
        return like.new_empty(self.length, *shape, self.count, dtype=dtype or like.dtype)

    def cut(self, signal: Tensor) -> Tensor:
        """(N, …) → (length, …, count); what stays, (1, …) → (length, …, 1)."""
        if len(signal) < self.samples:
            return signal.movedim(0, -1).expand(self.length, *signal.shape[1:], 1)
        found = self.empty(signal, signal.shape[1:])
        whole = self.samples // self.length
        filled = signal[: whole * self.length].unflatten(0, (whole, self.length))
        found[..., :whole] = filled.movedim(0, -1)
        if whole < self.count:
            left = self.samples - whole * self.length
            found[:left, ..., whole], found[left:, ..., whole] = signal[whole * self.length :], signal[-1]
        return found

    def joined(self, cut: Tensor) -> Tensor:
        """(length, …, count) → (N, …)."""
        return cut.movedim(-1, 0).flatten(0, 1)[: self.samples]


def composed(compose: Callable[..., tuple[Tensor, ...]], blocks: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
    """What the first 1, 2, …, B blocks make together of what comes into them, from what each does: each tensor
    (…, blocks). compose(earlier, later). Twice as many blocks at every turn (Hillis & Steele 1986)."""
    reach, count = 1, blocks[0].shape[-1]
    while reach < count:
        further = compose(tuple(b[..., :-reach] for b in blocks), tuple(b[..., reach:] for b in blocks))
        blocks = tuple(torch.cat([b[..., :reach], f], dim=-1) for b, f in zip(blocks, further, strict=True))
        reach *= 2
    return blocks
