"""Least squares of a few unknowns of which some may move to one side only, for many right-hand sides at once."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.optimize import nnls

# More bounded unknowns have too many faces (2 to their number) to try them all.
MOST_FACES = 10
RIDGE = 1e-12


def bounded_least_squares(
    gram: np.ndarray, slopes: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Minimizers x of ‖A x − y‖² within low ≤ x ≤ high, each bound 0 or infinite, and the reductions of it from x = 0.

    gram: AᵀA (k, k), of full rank. slopes: Aᵀy, (draws, k). Returns x (draws, k) and the reductions (draws,). At the
    minimum some of the bounded unknowns are zero and the others free of their bounds, a face of the box: every face is
    solved, and the best of those whose solution respects the bounds is the minimum (Lawson & Hanson 1974, Chapter 23).

    >>> gram, slopes = np.eye(2), np.array([[3.0, -4.0]])
    >>> bounded_least_squares(gram, slopes, np.zeros(2), np.full(2, np.inf))
    (array([[3., 0.]]), array([9.]))
    """
    length = np.sqrt(np.diagonal(gram))
    # An unknown that nothing depends on stays where it is.
    length = np.where(length > 0, length, 1.0)
    gram, slopes = gram / length / length[:, None] + RIDGE * np.eye(len(gram)), slopes / length
    # Turned round where only negative values are allowed, so that all bounds are x ≥ 0.
    side = np.where(high == 0, -1.0, 1.0)
    gram, slopes = gram * side * side[:, None], slopes * side
    bounded = (low == 0) | (high == 0)
    solve = _faces if bounded.sum() <= MOST_FACES else _one_by_one
    x = solve(gram, slopes, bounded)
    gain = (x * (2 * slopes - x @ gram)).sum(1)
    return x * side / length, gain


def _faces(gram: np.ndarray, slopes: np.ndarray, bounded: np.ndarray) -> np.ndarray:
    best, x = np.zeros(len(slopes)), np.zeros_like(slopes)
    for inside in product((True, False), repeat=int(bounded.sum())):
        free = ~bounded
        free[bounded] = inside
        if not free.any():
            continue
        solution = np.linalg.solve(gram[np.ix_(free, free)], slopes[:, free].T).T
        gain = (solution * slopes[:, free]).sum(1)
        allowed = (solution[:, bounded[free]] >= 0).all(1) & (gain > best)
        best[allowed] = gain[allowed]
        x[allowed] = 0.0
        x[np.ix_(allowed, free)] = solution[allowed]
    return x


def _one_by_one(gram: np.ndarray, slopes: np.ndarray, bounded: np.ndarray) -> np.ndarray:
    """The free unknowns are eliminated, the bounded ones left to Lawson and Hanson's algorithm."""
    free = ~bounded
    mixed = np.linalg.solve(gram[np.ix_(free, free)], np.c_[gram[np.ix_(free, bounded)], slopes[:, free].T])
    coupling, alone = mixed[:, : bounded.sum()], mixed[:, bounded.sum() :].T
    rest = gram[np.ix_(bounded, bounded)] - gram[np.ix_(bounded, free)] @ coupling
    upper = np.linalg.cholesky(rest).T
    targets = np.linalg.solve(upper.T, (slopes[:, bounded] - alone @ gram[np.ix_(free, bounded)]).T).T
    x = np.zeros_like(slopes)
    x[:, bounded] = [nnls(upper, target)[0] for target in targets]
    x[:, free] = alone - x[:, bounded] @ coupling.T
    return x
