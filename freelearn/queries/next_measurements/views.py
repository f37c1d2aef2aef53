"""What a plan is judged by: the least of its views of what it is to tell, over visits that it may choose from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

# One thing that a plan is to tell, linearized: coefficients of interest beside those that have to be refitted.

# Share of a column's usual information that is added to what is known of it: a direction that no row has told of.
RIDGE = 1e-9


@dataclass(frozen=True)
class InformationMatrix:
    """columns: (P, L, 2, k), derivatives of the readings by k coefficients at every candidate row, in units of its own
    errors: those refitted first, then the `interest` that are asked for. known: (k, k), what the rows that are
    measured already tell. name: what it tells.

    What is told is the information of interest after refitting the others, S = M_bb − M_ba M_aa⁻¹ M_ab of M, what is
    known and what a plan adds, and in one number g = det(S)^(1/q): the precision of one parameter (c-optimality), of
    several (D_s-optimality, Atkinson & Donev 1992), or the non-centrality of a rival's χ² (T-optimality, Atkinson &
    Fedorov 1975). All are concave and of first degree in M."""

    name: tuple[str, ...]
    columns: np.ndarray
    known: np.ndarray
    interest: int = 1

    @classmethod
    def scaled(
        cls, name: tuple[str, ...], columns: np.ndarray, known: np.ndarray, interest: int = 1
    ) -> InformationMatrix:
        """A view whose refitted coefficients are in units of which what is known and a usual row tell about one, so
        that no unit decides what counts as told. Those of interest keep theirs."""
        usual = np.square(columns).sum((0, 1, 2)) / max(columns.shape[0] * columns.shape[1], 1)
        length = np.sqrt(np.diagonal(known) + usual)
        length[len(length) - interest :] = 1.0
        length = np.where(length > 0, length, 1.0)
        known = known / length / length[:, None] + RIDGE * np.eye(len(known))
        return cls(name, columns / length, known, interest)


def remaining(information: np.ndarray, interest: int) -> np.ndarray:
    """S of matrices (…, k, k) of which the last q = interest coefficients are asked for: (…, q, q)."""
    free = information.shape[-1] - interest
    if not free:
        return np.asarray(information)
    across = information[..., :free, free:]
    solved = np.linalg.solve(information[..., :free, :free], across)
    return np.asarray(information[..., free:, free:] - across.swapaxes(-1, -2) @ solved)


def value(information: np.ndarray, interest: int) -> np.ndarray:
    """g = det(S)^(1/q) of matrices (…, k, k): (…,)."""
    left = remaining(information, interest)
    if interest == 1:
        return np.asarray(np.maximum(left[..., 0, 0], 0.0))
    return np.asarray(np.maximum(np.linalg.det(left), 0.0) ** (1 / interest))


def slope(information: np.ndarray, interest: int) -> np.ndarray:
    """U (k, q) with ∂g/∂M = U Uᵀ at an information (k, k); tr(UᵀM U) = g."""
    direction = refitted(information, interest)
    if interest == 1:
        return direction
    left = remaining(information, interest)
    size, axes = np.linalg.eigh(left)
    size = np.maximum(size, 1e-300)
    root = axes * np.sqrt(float(np.prod(size ** (1 / interest))) / interest / size)
    return np.asarray(direction @ root)


def refitted(information: np.ndarray, interest: int) -> np.ndarray:
    """How all coefficients move when one of interest does and the others are refitted: (k, q)."""
    free = information.shape[-1] - interest
    if not free:
        return np.eye(interest)
    solved = np.linalg.solve(information[:free, :free], information[:free, free:])
    return np.concatenate([-solved, np.eye(interest)])


# Candidate visits: places that the bed can go to, and the pressures that may be read there.


@dataclass(frozen=True)
class Visits:
    """P places of L rows each, of which a visit of the bed reads some, in one mounting.

    shared: (P, L, 2, 2), what the position error that a visit's rows share does to each row's two readings, in units of
    the row's own errors (see `noise.Whitener`). usable: (P, L) bool, rows with an answer. subsets: (S, L)
    bool, the sets of rows that a visit may read. A visit goes by the number place · S + subset.
    """

    shared: np.ndarray
    usable: np.ndarray
    subsets: np.ndarray

    @classmethod
    def from_masks(cls, shared: np.ndarray, usable: np.ndarray) -> Visits:
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


# What a plan is judged by: the least of its views.

# Weight of the views' mean beside their least: among plans whose least view is alike the others decide.
MEAN = 1e-3

# Of each view, a (k, k) matrix, or (c, k, k) of several plans.
Matrices = list[np.ndarray]


@dataclass(frozen=True)
class Objective:
    """Visits, and what is to be told by some of them."""

    visits: Visits
    views: Sequence[InformationMatrix]

    @property
    def known(self) -> Matrices:
        """What is measured already."""
        return [view.known for view in self.views]

    def each(self, visits: np.ndarray) -> Matrices:
        """What each of some visits (c,) adds."""
        return [self.visits.added(view.columns, visits) for view in self.views]

    def values(self, matrices: Matrices) -> np.ndarray:
        """What every view tells: (V,), or (V, c) of several plans."""
        pairs = zip(matrices, self.views, strict=True)
        return np.stack([value(information, view.interest) for information, view in pairs])

    def merit(self, matrices: Matrices) -> np.ndarray:
        """The least, and a little of the mean: (), or (c,)."""
        values = self.values(matrices)
        return np.asarray(values.min(0) + MEAN * values.mean(0))

    def slopes(self, matrices: Matrices) -> list[np.ndarray]:
        """U of every view, see view.slope."""
        return [slope(m, view.interest) for m, view in zip(matrices, self.views, strict=True)]

    def sensitivities(self, slopes: Sequence[np.ndarray]) -> np.ndarray:
        """How much every visit would add to every view, to first order: (V, P, S)."""
        return np.stack(
            [self.visits.sensitivities(view.columns @ u) for view, u in zip(self.views, slopes, strict=True)]
        )
