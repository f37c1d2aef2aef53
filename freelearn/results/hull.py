"""The convex hull of points in a plane."""

from __future__ import annotations

import numpy as np

# Corners that stick out by less than this share of the points' extent are none: rounding makes them.
FLAT = 1e-9


def hull(points: np.ndarray) -> np.ndarray:
    """Positions of the hull's vertices, counterclockwise from the leftmost: Andrew's monotone chain, which also takes
    points on one line, where there are two, and a single point. points: (N, 2), finite.

    >>> hull(np.array([[0.0, 0], [2, 0], [1, 0], [2, 2], [0, 2], [1, 1]])).tolist()
    [0, 1, 3, 4]
    >>> hull(np.array([[0.0, 0], [1, 1], [2, 2]])).tolist()
    [0, 2]
    """
    extent = np.ptp(points, axis=0)
    scaled = points / np.where(extent > 0, extent, 1.0)
    order = [int(i) for i in np.lexsort((scaled[:, 1], scaled[:, 0]))]
    lower, upper = _chain(scaled, order), _chain(scaled, order[::-1])
    # Each ends where the other begins.
    return np.array(lower[:-1] + upper[:-1] if len(lower) > 1 else lower, dtype=np.int64)


def _chain(points: np.ndarray, order: list[int]) -> list[int]:
    """The points that have none on their right, on the way from the first to the last."""
    kept: list[int] = []
    for here in order:
        if kept and np.abs(points[here] - points[kept[-1]]).max() <= FLAT:
            continue
        while len(kept) > 1 and _turn(points, kept[-2], kept[-1], here) <= FLAT:
            kept.pop()
        kept.append(here)
    return kept


def _turn(points: np.ndarray, first: int, second: int, third: int) -> float:
    """Twice the area of a triangle: positive where it turns to the left."""
    (ax, ay), (bx, by) = points[second] - points[first], points[third] - points[first]
    return float(ax * by - ay * bx)
