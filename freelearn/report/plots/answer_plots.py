"""What was asked of a fitted model, and its answers with their bands, row by row or over time."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from freelearn.common.display import COLORS
from freelearn.data.beds import BEDS, Quantity
from freelearn.queries.answers import STATUS, Answers
from freelearn.queries.curves.curve_rows import pressures
from freelearn.report.plots.canvas import finish, new_figure

TIME, RUN = "time_s", "run"
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
    run = _runs(table)
    over, label = _along(table, run)
    for number, quantity in enumerate(shown, 1):
        axes = figure.add_subplot(len(shown), 1, number)
        for first in range(int(run[-1]) + 1):
            own = run == first
            _draw(axes, over[own], table[own], quantity, quantity.column in answers.asked, len(table) <= MOST_MARKS)
        _legend(axes)
        finish(axes, label if number == len(shown) else "", f"{quantity.name} {quantity.symbol}\n[{quantity.unit}]")
    figure.subplots_adjust(left=0.13, right=0.98, top=1 - 0.15 / figure.get_figheight(), hspace=0.18,
                           bottom=0.55 / figure.get_figheight())  # fmt: skip
    return figure


def _runs(table: pd.DataFrame) -> np.ndarray:
    """The number of every row's recording, from 0; one where the table is no log."""
    if RUN not in table or TIME not in table:
        return np.zeros(len(table), dtype=int)
    named = table[[name for name in ("sample", RUN) if name in table]]
    number: np.ndarray = (named != named.shift()).any(axis=1).cumsum().to_numpy() - 1
    return number


def _along(table: pd.DataFrame, run: np.ndarray) -> tuple[pd.Series, str]:
    """What the rows are drawn over, and its label: recordings that begin anew stand end to end."""
    if TIME not in table:
        return pd.Series(np.arange(1, len(table) + 1), index=table.index), "row"
    time, label = table[TIME].astype(float), "time [s]"
    for number in range(1, int(run[-1]) + 1):
        own, before = run == number, time[run == number - 1]
        if time[own].iloc[0] <= before.iloc[-1]:
            # One usual step apart.
            step = float(before.diff().median()) if len(before) > 1 else 1.0
            time[own] += before.iloc[-1] + step - time[own].iloc[0]
            label = "time [s], recordings end to end"
    return time, label


def _says(table: pd.DataFrame, quantity: Quantity) -> bool:
    """Whether an answer is more than the same number in all rows, such as a braid's moment of 0."""
    value, low = table[quantity.column], f"{quantity.column}_low"
    return bool(np.ptp(value.dropna()) > 1e-9 * value.abs().max() or (low in table and table[low].notna().any()))


def _quantities(table: pd.DataFrame) -> list[Quantity]:
    """Those of the table, in the order of the contract."""
    known = {q.column: q for bed in BEDS.values() for q in (*bed.imposed, *bed.measured)}
    known |= {q.column: q for q in pressures(table)}
    return [quantity for name, quantity in known.items() if name in table and table[name].notna().any()]


def _draw(axes: Axes, over: pd.Series, table: pd.DataFrame, quantity: Quantity, asked: bool, few: bool) -> None:
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
