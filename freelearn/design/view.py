"""One thing that a plan is to tell, linearized: coefficients of interest beside those that have to be refitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Share of a column's usual information that is added to what is known of it: a direction that no row has told of.
RIDGE = 1e-9


@dataclass(frozen=True)
class View:
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
    def scaled(cls, name: tuple[str, ...], columns: np.ndarray, known: np.ndarray, interest: int = 1) -> View:
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
