"""Several samples' length × twist planes side by side in one Axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

# Free room beside each cell, as a share of the lengths shown.
MARGIN = 0.12
SMALLEST, LARGEST = 3.5, 15.0
MOST_COMPARED = 1500
# With more cells than this only two ticks stand under each.
FEW = 4


class Cells:
    """Cells of equal length and twist range, one per sample, laid out from left to right in one Axes.

    One Axes instead of one per sample, because matplotlib draws sixteen of them in half a second. states: every
    kinematic state shown (sample, elongation_mm, twist_deg), each once.
    """

    def __init__(self, states: pd.DataFrame, samples: Sequence[int] | np.ndarray):
        self.states, self.samples = states, list(samples)
        self.low, self.high = _range(states["elongation_mm"])
        self.bottom, self.top = _range(states["twist_deg"])
        self.width = self.high - self.low
        self._left = {sample: number * self.width for number, sample in enumerate(self.samples)}

    def across(self) -> pd.Series:
        """Where each state lies along the Axes; in the first cell that is its elongation."""
        return self.states["elongation_mm"] + self.states["sample"].map(self._left)

    def middle(self, sample: int) -> float:
        """The middle of a sample's cell, along the Axes."""
        return (self.low + self.high) / 2 + self._left[sample]

    def frame(self, axes: Axes, bottom: bool) -> None:
        """Limits, labels with units, the lines between cells, and each cell's ticks at the bottom row."""
        count = max(len(self.samples), 1)
        axes.set_xlim(self.low, self.low + count * self.width)
        axes.set_ylim(self.bottom, self.top)
        axes.vlines(self.low + self.width * np.arange(1, count), self.bottom, self.top, color="black", lw=0.8)
        ticks = np.asarray(MaxNLocator(5 if count == 1 else 2).tick_values(self.low, self.high))
        # Off the cell's edges, where labels of neighbours would touch.
        ticks = ticks[(ticks > self.low + 0.05 * self.width) & (ticks < self.high - 0.05 * self.width)]
        if count > FEW and len(ticks) > 2:
            # Each tick takes a millisecond to draw; the outer two still give the scale.
            ticks = ticks[[0, -1]]
        if bottom:
            labels = [f"{tick:g}".replace("-", "−") for tick in ticks]
            axes.set_xticks([tick + left for left in self._left.values() for tick in ticks], labels * len(self.samples))
            axes.set_xlabel("elongation [mm]")
        else:
            axes.set_xticks([])
        axes.yaxis.set_major_locator(MaxNLocator(4))
        axes.set_ylabel("twist [deg]")

    def marker_area(self, axes: Axes) -> float:
        """Area of a square marker [points²] that fills the usual distance between neighbouring states."""
        figure = axes.get_figure(root=True)
        assert figure is not None
        place = axes.get_position()
        points = 72 * np.array(figure.get_size_inches()) * (place.width, place.height)
        scale = points / (self.width * max(len(self.samples), 1), self.top - self.bottom)
        nearest = []
        for _, part in self.states.groupby("sample"):
            here = part[["elongation_mm", "twist_deg"]].to_numpy(dtype=np.float64)[:MOST_COMPARED] * scale
            apart = np.abs(here[:, None] - here).max(axis=2)
            np.fill_diagonal(apart, np.inf)
            nearest.append(apart.min(axis=1))
        distance = np.median(np.concatenate(nearest)) if nearest else LARGEST
        return float(np.clip(0.85 * distance, SMALLEST, LARGEST)) ** 2


def _range(values: pd.Series) -> tuple[float, float]:
    """The values' range, widened a little; never empty."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    room = MARGIN * (high - low) or 1.0
    return low - room, high + room
