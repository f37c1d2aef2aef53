"""Candidate visits: places that the bed can go to, and the pressures that may be read there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Visits:
    """P places of L rows each, of which a visit of the bed reads some, in one mounting.

    shared: (P, L, 2, 2), what the position error that a visit's rows share does to each row's two readings, in units of
    the row's own errors (see `inference.noise.Whitener`). usable: (P, L) bool, rows with an answer. subsets: (S, L)
    bool, the sets of rows that a visit may read. A visit goes by the number place · S + subset.
    """

    shared: np.ndarray
    usable: np.ndarray
    subsets: np.ndarray

    @classmethod
    def of(cls, shared: np.ndarray, usable: np.ndarray) -> Visits:
        """Visits of any of a place's rows."""
        rows = shared.shape[1]
        every = np.arange(1, 2**rows)
        subsets = (every[:, None] >> np.arange(rows)) % 2 == 1
        return cls(shared, usable, subsets[np.argsort(subsets.sum(1), kind="stable")])

    @cached_property
    def sizes(self) -> np.ndarray:
        """Rows of each subset, (S,)."""
        return np.asarray(self.subsets.sum(1))

    @property
    def largest(self) -> int:
        """Rows up to which there are visits of every size, somewhere."""
        there = {0, *np.unique(self.sizes[self.allowed.any(0)]).tolist()}
        return next(n for n in range(len(there) + 1) if n + 1 not in there)

    @cached_property
    def allowed(self) -> np.ndarray:
        """Whether all rows of a visit have an answer, (P, S) bool."""
        return np.asarray((~self.usable).astype(np.float64) @ self.subsets.T.astype(np.float64) == 0)

    @cached_property
    def shrunk(self) -> np.ndarray:
        """(I + Σ AᵀA)⁻¹ of each visit, (P, S, 2, 2): what its rows leave unknown of its position error."""
        each = np.einsum("plij,plik->pljk", self.shared, self.shared)
        total = np.einsum("sl,pljk->psjk", self.subsets.astype(np.float64), each) + np.eye(2)
        return np.asarray(np.linalg.inv(total))

    def rows_of(self, visit: int) -> tuple[int, np.ndarray]:
        """The place of a visit, and the rows that it reads there."""
        place, subset = divmod(int(visit), len(self.subsets))
        return place, np.flatnonzero(self.subsets[subset])

    def sizes_of(self, visits: np.ndarray) -> np.ndarray:
        """Rows of each of some visits, (c,)."""
        return np.asarray(self.sizes[np.asarray(visits, dtype=np.int64) % len(self.subsets)])

    def added(self, columns: np.ndarray, visits: np.ndarray) -> np.ndarray:
        """What each of some visits (c,) tells of k coefficients: (c, k, k). columns: (P, L, 2, k), in units of each
        row's own errors.

        With X the columns of a visit's rows and A those of its shared error, Xᵀ(I + A Aᵀ)⁻¹X =
        XᵀX − (AᵀX)ᵀ (I + AᵀA)⁻¹ AᵀX (Woodbury)."""
        place, subset = np.divmod(np.asarray(visits, dtype=np.int64), len(self.subsets))
        chosen = np.where(self.subsets[subset][:, :, None, None], columns[place], 0.0)
        pulled = np.einsum("clij,clik->cjk", self.shared[place], chosen)
        flat = chosen.reshape(len(place), 2 * columns.shape[1], columns.shape[-1])
        return np.asarray(
            flat.transpose(0, 2, 1) @ flat - pulled.transpose(0, 2, 1) @ self.shrunk[place, subset] @ pulled
        )

    def sensitivities(self, combined: np.ndarray) -> np.ndarray:
        """tr(UᵀG U) of every visit's information G, (P, S), −∞ where it is not possible. combined: columns U, (P, L, 2,
        q)."""
        chosen = self.subsets.astype(np.float64)
        each = np.square(combined).sum((2, 3)) @ chosen.T
        pulled = np.einsum("plij,plik->pljk", self.shared, combined)
        summed = np.einsum("sl,pljk->psjk", chosen, pulled)
        each = each - np.einsum("psjk,psji,psik->ps", summed, self.shrunk, summed)
        return np.where(self.allowed, each, -np.inf)
