"""What every picture of a sweep's errors shares: the order of sets, one scale, the mean of a map."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from freelearn.common.formats import RUN_AWAY, percent
from freelearn.data.sets import CONSTITUENT_SET

# The end of every color scale [%]: at 100 % a model does no better than none.
WORST = 500.0
# Sets of several samples, in reading order, and last what was not fitted.
GROUPS = ("even", "all", CONSTITUENT_SET)


def error_range(cells: pd.DataFrame) -> tuple[float, float]:
    """Ends [%] of one logarithmic color scale for every map drawn from `cells` (column E, a fraction). What lies beyond
    WORST has the last color: a model that is off a thousandfold would leave the others one shade.

    >>> error_range(pd.DataFrame({"E": [0.021, 2.0]})), error_range(pd.DataFrame({"E": [0.021, 400.0]}))
    ((2.0, 210.0), (2.0, 500.0))
    """
    error = 100 * cells["E"].to_numpy(dtype=np.float64)
    error = error[np.isfinite(error) & (error > 0)]
    low, high = (float(error.min()), float(error.max())) if len(error) else (1.0, 100.0)
    return low / 1.05, max(min(high * 1.05, WORST), 1.2 * low)


def set_order(names: pd.Series) -> list[str]:
    """Set names in reading order: samples by number, groups, what was not fitted.

    >>> set_order(pd.Series(["all", "without2", "sample10", "sample3", "constituent", "even"]))
    ['sample3', 'sample10', 'without2', 'even', 'all', 'constituent']
    """

    def rank(name: str) -> tuple[int, int]:
        digits = int("".join(c for c in name if c.isdigit()) or 0)
        kind = GROUPS.index(name) + 2 if name in GROUPS else int(name.startswith("without"))
        return (kind, digits)

    return sorted(names.unique(), key=rank)


def error_grid(cells: pd.DataFrame, across: list[str], down: list[str]) -> np.ndarray:
    """E [%] of one label: test sets down, training sets across; NaN where nothing was evaluated.

    cells: train, test, E (a fraction)."""
    grid = cells.pivot_table(index="test", columns="train", values="E").reindex(index=down, columns=across)
    values: np.ndarray = 100 * grid.to_numpy(dtype=np.float64)
    return values


def cell_text(error: float) -> str:
    """An error [%] in a cell's few letters; blank where there is none, and of a model that has run away no more than
    that.

    >>> [cell_text(error) for error in (0.7027, 21.16, 271.2, 43943.0, float("nan"))]
    ['0.7', '21.2', '271', '>1k', '']
    """
    if not np.isfinite(error):
        return ""
    if error > 100 * RUN_AWAY:
        return f">{RUN_AWAY / 10:.0f}k"
    return f"{error:.1f}" if error < 99.95 else f"{error:.0f}"


def mean_text(cells: pd.DataFrame) -> str:
    """Mean and median over one label's fitted cells [%], with the mean's spread over seeds where there are several."""
    fitted = cells[cells["train"] != CONSTITUENT_SET]
    text = f"mean {percent(fitted['E'].mean(), 1)} %, median {percent(fitted['E'].median(), 1)} %"
    deviation = fitted["deviation"].mean()
    if not deviation > 0:
        return text
    return f"{text} (± {percent(deviation, 1)} in a cell, over {fitted['seeds'].max()} seeds)"


def caption(ours: pd.Series, published: Mapping[str, float] | None, simulated: bool) -> str:
    """Our figures of one label (a row of sweep.summary) beside the paper's, which measured other, real samples."""
    parts = {"mean": "mean", "median": "median", "range": "range", "diagonal": "own set", "min": "least", "max": "most"}
    lines = [f"{'E [%]':<8}{'here':>7}" + (f"{'paper':>7}" if published else "")]
    for part, name in parts.items():
        line = f"{name:<8}{percent(ours[part], 1):>7}"
        lines.append(line + (f"{percent(published.get(part), 1):>7}" if published else ""))
    here = "simulated data" if simulated else "measured data"
    return "\n".join([*lines, f"here: {here}", *(["paper: its own real samples"] if published else [])])
