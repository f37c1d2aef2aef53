"""Pressures that were set again and again."""

from __future__ import annotations

from typing import NamedTuple

from torch import Tensor


class Levels(NamedTuple):
    """Of N rows and k pressures. group: number of the level that each was set to, (N, k) int64. error: by how much all
    rows of it err alike [Pa], (N, k): one standard deviation of what their readings' mean leaves; 0 of pressures that
    were set to none."""

    group: Tensor
    error: Tensor

    def of(self, rows: Tensor | slice) -> Levels:
        """Those of some rows."""
        return Levels(self.group[rows], self.error[rows])
