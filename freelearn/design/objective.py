"""What a plan is judged by: the least of its views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from freelearn.design.view import View, slope, value
from freelearn.design.visits import Visits

# Weight of the views' mean beside their least: among plans whose least view is alike the others decide.
MEAN = 1e-3

# Of each view, a (k, k) matrix, or (c, k, k) of several plans.
Matrices = list[np.ndarray]


@dataclass(frozen=True)
class Objective:
    """Visits, and what is to be told by some of them."""

    visits: Visits
    views: Sequence[View]

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
