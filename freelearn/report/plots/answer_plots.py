"""What was asked of a fitted model, and its answers with their bands, row by row or over time."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from freelearn.common.display import COLORS
from freelearn.data.beds import BEDS, Quantity
from freelearn.data.logs import TIME, is_log, run_numbers, session_clock
from freelearn.queries.answers import STATUS, Answers
from freelearn.queries.curves.curve_rows import pressures
from freelearn.report.plots.canvas import finish, new_figure

# Fewer answers are read in the table.
LEAST_ROWS = 3
# Points of a single answer are seen up to so many.
MOST_MARKS = 60
WIDTH, PANEL = 8.0, 1.9  # inches


def answers_figure(answers: Answers) -> Figure | None:
    """A panel for each quantity that changes, or was asked: what was given as a gray line, answers in color with the
    band in which a new measurement lies with 95 %. None for few rows, or where nothing was answered."""
    table = answers.filled
    shown = [q for q in _quantities(table) if q.column in answers.asked or table[q.column].nunique() > 1]
    answered = [q for q in shown if q.column in answers.asked and table[q.column].notna().any()]
    if len(table) < LEAST_ROWS or not any(_says(table, q) for q in answered):
        return None
    shown = [q for q in shown if q.column not in answers.asked or (q in answered and _says(table, q))]
    figure = new_figure(WIDTH, 0.7 + PANEL * len(shown))
    run, over, label = _along(table)
    for number, quantity in enumerate(shown, 1):
        axes = figure.add_subplot(len(shown), 1, number)
        for own in (run == recording for recording in np.unique(run)):
            _draw(axes, over[own], table[own], quantity, quantity.column in answers.asked, len(table) <= MOST_MARKS)
        _legend(axes)
        finish(axes, label if number == len(shown) else "", f"{quantity.name} {quantity.symbol}\n[{quantity.unit}]")
    figure.subplots_adjust(left=0.13, right=0.98, top=1 - 0.15 / figure.get_figheight(), hspace=0.18,
                           bottom=0.55 / figure.get_figheight())  # fmt: skip
    return figure


def _along(table: pd.DataFrame) -> tuple[np.ndarray, np.ndarray, str]:
    """Number of each row's recording, what the rows are drawn over, and its label: recordings whose clocks begin anew
    stand end to end. What is no log counts as one recording."""
    one = np.zeros(len(table), dtype=int)
    if TIME not in table:
        return one, np.arange(1, len(table) + 1), "row"
    time = table[TIME].to_numpy(float)
    if not is_log(table):
        return one, time, "time [s]"
    # Questions about a single actuator need not name it.
    run = run_numbers(table if "sample" in table else table.assign(sample=0))
    clock = session_clock(table.assign(sample=0, run=run))
    if np.allclose(clock, time - time[0]):
        return run, time, "time [s]"
    return run, clock, "time [s], recordings end to end"


def _says(table: pd.DataFrame, quantity: Quantity) -> bool:
    """Whether an answer is more than the same number in all rows, such as a braid's moment of 0."""
    value, low = table[quantity.column], f"{quantity.column}_low"
    return bool(np.ptp(value.dropna()) > 1e-9 * value.abs().max() or (low in table and table[low].notna().any()))


def _quantities(table: pd.DataFrame) -> list[Quantity]:
    """Those of the table, in the order of the contract."""
    known = {q.column: q for bed in BEDS.values() for q in (*bed.imposed, *bed.measured)}
    known |= {q.column: q for q in pressures(table)}
    return [quantity for name, quantity in known.items() if name in table and table[name].notna().any()]


def _draw(axes: Axes, over: np.ndarray, table: pd.DataFrame, quantity: Quantity, asked: bool, few: bool) -> None:
    """One recording. few: points are marked."""
    name = quantity.column
    if not asked:
        axes.plot(over, table[name], color="#555555", lw=1.4, marker="." if few else None, label="given")
    else:
        good = (table[STATUS] == "ok").to_numpy() & table[name].notna().to_numpy()
        value = table[name].where(good)
        low, high = (f"{name}_{end}" for end in ("low", "high"))
        if low in table and table[low].notna().any():
            axes.fill_between(over, table[low].where(good), table[high].where(good), color=COLORS[0], alpha=0.25, lw=0,
                              label="95 % band")  # fmt: skip
        axes.plot(over, value, color=COLORS[0], lw=1.6, marker="." if few else None, label="answered")
        if not good.all():
            axes.plot(over[~good], np.zeros((~good).sum()), "x", color=COLORS[1], ms=4, label="no answer",
                      transform=axes.get_xaxis_transform(), clip_on=False)  # fmt: skip


def _legend(axes: Axes) -> None:
    """Each label once, however many recordings have it."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(once.values(), once.keys(), loc="best", frameon=False, fontsize=8)
