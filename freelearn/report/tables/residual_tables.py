"""Where over what is imposed a model is wrong, as numbers, several samples' planes side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from freelearn.data.beds import KINEMATIC, Pair, Quantity, bed_of, behind
from freelearn.physics.chain.prediction import usable
from freelearn.queries.curves.curve_rows import misses
from freelearn.queries.curves.shown_states import fields

# Several samples' planes, length × twist or what else was imposed, side by side on one axis.

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
        plane, see shown_states.fields."""
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


# Where over what is imposed a model is wrong, as numbers.

# Samples shown side by side; more of them would be too narrow to read.
MOST_SAMPLES = 8
# Fields that are drawn; more would only lie on top of each other, and fill the page.
MOST_FIELDS = 20_000
# A residual below this share of the largest reading is rounding: drawn on a scale of its own it would look like one.
ROUNDING = 1e-9

# The end of the color scale of a sample's residuals, by sample and the quantity's column.
Limits = Mapping[tuple[int, str], float]


def residual_table(predictions: pd.DataFrame, over: Pair | None = None) -> pd.DataFrame:
    """Each field's place and, over its usable rows, the mean of measured − predicted of all that the bed measures
    (blank without one) and their number `rows`. Columns sample, those of the place, those of the quantities, rows.

    predictions: columns of predictions.csv. over: see states.fields; by default each kinematic state is a field."""
    predictions = predictions.reset_index(drop=True)
    number, where = fields(predictions, over)
    rows = usable(predictions)
    residual = misses(rows).reindex(columns=[q.column for q in bed_of(predictions).measured])
    present = residual.notna().any(axis=1)
    read = residual if present.all() else residual[present]
    grouped = read.groupby(pd.Series(number)[read.index])
    means = grouped.mean().assign(rows=grouped.size()).rename_axis("state")
    return where.join(means).fillna({"rows": 0}).reset_index(drop=True)


def drawn(table: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """The fields that a picture draws of a residual_table, and how many these are, in words; "" for all of them.

    Drawn at random, the same ones each time: every n-th could fall on the same length."""
    if len(table) <= MOST_FIELDS:
        return table, ""
    chosen = np.sort(np.random.default_rng(0).choice(len(table), MOST_FIELDS, replace=False))
    return table.iloc[chosen].reset_index(drop=True), f"{MOST_FIELDS} of {len(table)} places shown"


def scale_end(values: ArrayLike, least: float = 0.0) -> float:
    """The end of a color scale that is symmetric about zero; 1 where there is nothing to show. least: what is no larger
    is nothing.

    >>> scale_end([-3.0, 2.0, float("nan")]), scale_end([]), scale_end([2e-15, -1e-15], 1e-6)
    (3.0, 1.0, 1.0)
    """
    largest = largest_of(values)
    return largest if largest > least else 1.0


def largest_of(values: ArrayLike) -> float:
    """The largest size among the values that are known; 0 without one."""
    size = np.abs(np.asarray(values, dtype=np.float64))
    size = size[np.isfinite(size)]
    return float(size.max()) if len(size) else 0.0


def scale_limits(predictions: Sequence[pd.DataFrame], over: Pair, quantities: Sequence[Quantity]) -> Limits:
    """The ends of the color scales on which several maps of the same rows, such as before and after, compare.

    predictions: each in the columns of predictions.csv."""
    tables = [residual_table(table, over) for table in predictions]
    together = pd.concat(tables, ignore_index=True)
    readings = predictions[0].groupby("sample")[[quantity.column for quantity in quantities]].agg(largest_of)
    return {
        (int(sample), quantity.column): scale_end(part[quantity.column], ROUNDING * readings[quantity.column][sample])
        for sample, part in together.groupby("sample")
        for quantity in quantities
    }


def limit_text(limit: float, unit: str) -> str:
    """What stands at a sample whose colors end at ± limit.

    >>> limit_text(123.4, "N·mm"), limit_text(2.0, "°")
    ('± 120 N·mm', '± 2°')
    """
    return f"± {float(f'{limit:.2g}'):g}{behind(unit)}"


def shown_samples(table: pd.DataFrame) -> tuple[list[int], str]:
    """The samples that a picture shows, and which ones these are, in words; "" for all of them."""
    present = [int(number) for number in np.sort(table["sample"].unique())]
    shown = present[:MOST_SAMPLES]
    return shown, f"first {len(shown)} of {len(present)} samples" if len(present) > len(shown) else ""
