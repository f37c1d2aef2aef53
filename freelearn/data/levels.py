"""Pressures that were set again and again."""

from __future__ import annotations

from typing import NamedTuple

from torch import Tensor


class Levels(NamedTuple):
    """Of N rows. group: number of the level that each was set to, (N,) int64. error: by how much all rows of it err
    alike [Pa], (N,): one standard deviation of what their readings' mean leaves."""

    group: Tensor
    error: Tensor

    def of(self, rows: Tensor | slice) -> Levels:
        """Those of some rows."""
        return Levels(self.group[rows], self.error[rows])
