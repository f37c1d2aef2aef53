"""Several samples' planes, length × twist or what else was imposed, side by side on one axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from freelearn.measurements.beds import KINEMATIC, Pair

# Free room beside each sample, as a share of the lengths shown.
MARGIN = 0.12


class Strip:
    """Parts of equal ranges, one per sample, laid out from left to right.

    x, y: the quantities across and up. low, high: the range of x that a part shows; bottom, top: that of y; width: of a
    part, in x's unit.

    >>> states = pd.DataFrame({"sample": [3, 3, 6], "elongation_mm": [0.0, 10.0, 0.0], "twist_deg": [0.0, 1.0, 2.0]})
    >>> strip = Strip(states, [3, 6])
    >>> round(strip.width, 6), strip.across().round(6).tolist(), strip.middle(6)
    (12.4, [0.0, 10.0, 12.4], 17.4)
    """

    def __init__(self, states: pd.DataFrame, samples: Sequence[int], plane: Pair = KINEMATIC.state) -> None:
        """states: every kinematic state shown (sample, elongation_mm, twist_deg), each once; or the fields of another
        plane, see results.states.fields."""
        self.states, self.samples = states, list(samples)
        self.x, self.y = plane
        self.low, self.high = _range(states[self.x.column])
        self.bottom, self.top = _range(states[self.y.column])
        self.width = self.high - self.low

    def left(self, sample: int) -> float:
        """How far a sample's part is moved to the right; 0 for the first."""
        return self.samples.index(sample) * self.width

    def across(self) -> pd.Series:
        """Where each state lies along the axis; in the first part that is x itself."""
        return self.states[self.x.column] + self.states["sample"].map({n: self.left(n) for n in self.samples})

    def up(self) -> pd.Series:
        """How high each state lies."""
        return self.states[self.y.column]

    def middle(self, sample: int) -> float:
        """The middle of a sample's part, along the axis."""
        return (self.low + self.high) / 2 + self.left(sample)


def spacing(values: pd.Series) -> float:
    """The distance between neighboring values, a little less than which a state's mark is wide: of the closest tenth,
    so that marks of places at uneven distances do not lie on each other."""
    distinct = np.unique(np.round(values.to_numpy(dtype=np.float64), 6))
    apart = np.diff(distinct)
    apart = apart[apart > 1e-3 * max(float(np.ptp(distinct)), 1e-9)] if len(apart) else apart
    # A bed that creeps visits no length twice: marks then are as narrow as can still be seen and clicked.
    return 0.94 * max(float(np.quantile(apart, 0.1)), 0.025 * float(np.ptp(distinct))) if len(apart) else 1.0


def _range(values: pd.Series) -> tuple[float, float]:
    """The values' range, widened a little; never empty."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    room = MARGIN * (high - low) or 1.0
    return low - room, high + room
