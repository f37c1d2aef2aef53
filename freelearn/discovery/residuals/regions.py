"""Regions of the inputs in which a quantity is much the same: the leaves of a shallow regression tree.

scikit-learn grows the same tree (a test compares the two), but importing it takes longer than a fit, and every run
looks for its failures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class Region:
    """inside: its rows, (N,) bool. low, high: low < input ≤ high, by the name of each input that it is bounded in."""

    inside: np.ndarray
    low: Mapping[str, float]
    high: Mapping[str, float]


class _Split(NamedTuple):
    gain: float
    name: str
    threshold: float


def regions(inputs: Mapping[str, np.ndarray], target: np.ndarray, depth: int, leaf: int, least: float) -> list[Region]:
    """The leaves of the tree that lowers the squared error of target (N, k) most, split after split.

    inputs: (N,) each. depth: most splits on the way to a leaf. leaf: fewest rows in one. least: mean squared error,
    over all N rows and k columns, that a split has to take away. (CART: Breiman, Friedman, Olshen & Stone 1984.)
    """

    def grow(region: Region, left: int) -> list[Region]:
        split = _best(inputs, target, region.inside, leaf) if left else None
        if split is None or split.gain / target.size < least:
            return [region]
        below = inputs[split.name] <= split.threshold
        first = Region(region.inside & below, region.low, {**region.high, split.name: split.threshold})
        second = Region(region.inside & ~below, {**region.low, split.name: split.threshold}, region.high)
        return [*grow(first, left - 1), *grow(second, left - 1)]

    return grow(Region(np.ones(len(target), dtype=bool), {}, {}), depth)


def _best(inputs: Mapping[str, np.ndarray], target: np.ndarray, inside: np.ndarray, leaf: int) -> _Split | None:
    """The split of the rows inside that lowers the sum of squares most; None where every side would be too small."""
    best: _Split | None = None
    # Of many rows every array counts: none that is not needed, and none longer than it is.
    rows = None if inside.all() else np.flatnonzero(inside)
    for name, values in inputs.items():
        order = np.argsort(values if rows is None else values[rows], kind="stable")
        order = order if rows is None else rows[order]
        along = values[order]
        rising = along[1:] > along[:-1]
        del along
        count = np.arange(1.0, len(order))
        possible = rising & (count >= leaf) & (len(order) - count >= leaf)
        if not possible.any():
            continue
        gains = _gains(target, order, count)
        gains[~possible] = -np.inf
        at = int(gains.argmax())
        if best is None or gains[at] > best.gain:
            best = _Split(float(gains[at]), name, float((values[order[at]] + values[order[at + 1]]) / 2))
    return best


def _gains(target: np.ndarray, order: np.ndarray, count: np.ndarray) -> np.ndarray:
    """By how much the sum of squares of target (N, k) falls where its rows, in some order (n,), are cut after the first
    1, 2, …, count (n − 1,). Column by column and in place: of many rows all of this at once would not fit."""
    gains = np.zeros(len(count))
    for column in target.T:
        before = column[order].cumsum()
        whole, before = before[-1], before[:-1]
        rest = whole - before
        np.square(before, out=before)
        before /= count
        np.square(rest, out=rest)
        rest /= len(order) - count
        before += rest
        before -= whole**2 / len(order)
        gains += before
    return gains
