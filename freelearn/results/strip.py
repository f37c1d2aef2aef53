"""Several samples' length × twist planes side by side on one axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

# Free room beside each sample, as a share of the lengths shown.
MARGIN = 0.12


class Strip:
    """Fields of equal length and twist range, one per sample, laid out from left to right.

    low, high: the elongations [mm] that a field shows; bottom, top: the twists [deg]; width: of a field [mm].

    >>> states = pd.DataFrame({"sample": [3, 3, 6], "elongation_mm": [0.0, 10.0, 0.0], "twist_deg": [0.0, 1.0, 2.0]})
    >>> strip = Strip(states, [3, 6])
    >>> round(strip.width, 6), strip.across().round(6).tolist(), strip.middle(6)
    (12.4, [0.0, 10.0, 12.4], 17.4)
    """

    def __init__(self, states: pd.DataFrame, samples: Sequence[int]) -> None:
        """states: every kinematic state shown (sample, elongation_mm, twist_deg), each once."""
        self.states, self.samples = states, list(samples)
        self.low, self.high = _range(states["elongation_mm"])
        self.bottom, self.top = _range(states["twist_deg"])
        self.width = self.high - self.low

    def left(self, sample: int) -> float:
        """How far a sample's field is moved to the right; 0 for the first."""
        return self.samples.index(sample) * self.width

    def across(self) -> pd.Series:
        """Where each state lies along the axis; in the first field that is its elongation."""
        return self.states["elongation_mm"] + self.states["sample"].map({n: self.left(n) for n in self.samples})

    def middle(self, sample: int) -> float:
        """The middle of a sample's field, along the axis."""
        return (self.low + self.high) / 2 + self.left(sample)


def spacing(values: pd.Series) -> float:
    """The usual distance between neighboring values, a little less than which a state's mark is wide."""
    distinct = np.unique(np.round(values.to_numpy(dtype=np.float64), 6))
    apart = np.diff(distinct)
    apart = apart[apart > 1e-3 * max(float(np.ptp(distinct)), 1e-9)] if len(apart) else apart
    # A bed that creeps visits no length twice: marks then are as narrow as can still be seen and clicked.
    return 0.94 * max(float(np.median(apart)), 0.025 * float(np.ptp(distinct))) if len(apart) else 1.0


def _range(values: pd.Series) -> tuple[float, float]:
    """The values' range, widened a little; never empty."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    room = MARGIN * (high - low) or 1.0
    return low - room, high + room
