"""A recording along its time, and the loops of its readings over the pressure, in as many points as a picture shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from freelearn.data.beds import Quantity
from freelearn.data.columns import usable_rows
from freelearn.data.logs import TIME, run_numbers
from freelearn.physics.chain.prediction import answered
from freelearn.queries.curves.curve_rows import measured_quantities, pressures
from freelearn.queries.curves.shown_states import squared_error

# Stretches of a recording of which a picture shows the least and the greatest: about one for each of its pixels.
STRETCHES = 600
# Of all loops of a sample together.
LOOPED = 1500
# A pressure's rate is that over this share of the recording to either side: over a sample alone it would be noise.
AROUND = 0.005
SECONDS = "time t [s]"
ABOUT_LOOPS = "Loops: thick of this recording, thin of the sample's others."
# What no recording of a sample is faster than but for so many of its samples ends the scale of rates.
MOST = 0.98


def extremes(values: np.ndarray, stretches: int = STRETCHES) -> np.ndarray:
    """Positions of the first and the last row and, in each of so many stretches of about as many rows, of the least and
    the greatest of every column: in order, each once. All of them where that is no more. values: (n, k), NaN counts
    for nothing.

    >>> extremes(np.array([[0.0], [5.0], [1.0], [2.0], [-3.0], [0.0], [1.0], [1.0]]), 2)
    array([0, 1, 4, 6, 7])
    """
    count, columns = values.shape
    if count <= (2 * columns) * stretches:
        return np.arange(count)
    each = -(-count // stretches)
    found = [np.array([0, count - 1])]
    start = np.arange(-(-count // each)) * each
    for column in values.T:
        blank = np.isnan(column)
        for worst, best in ((np.inf, np.argmin), (-np.inf, np.argmax)):
            padded = np.full(len(start) * each, worst)
            padded[:count] = np.where(blank, worst, column)
            # A stretch without a number has only what stands for none.
            place = best(padded.reshape(len(start), each), axis=1) + start
            found.append(place[np.isfinite(padded[place])])
    return np.unique(np.concatenate(found))


@dataclass(frozen=True)
class Signal:
    """A quantity over the time: what was imposed or measured, or what a model says. time: (n,) s; value: (n,) in the
    unit of its column; samples: of which these are the extremes."""

    time: np.ndarray
    value: np.ndarray
    samples: int

    @classmethod
    def drawn(cls, time: np.ndarray, value: np.ndarray, stretches: int = STRETCHES) -> Signal:
        """The extremes of what has a number."""
        there = np.flatnonzero(np.isfinite(value))
        kept = there[extremes(value[there, None], stretches)]
        return cls(time[kept], value[kept], len(there))


@dataclass(frozen=True)
class Trace:
    """Some rows of one recording. across: the pressure of its loops; imposed: of each pressure; measured: of each
    quantity; models: of each quantity by the model's name."""

    across: Signal
    imposed: dict[str, Signal]
    measured: dict[str, Signal]
    models: dict[str, dict[str, Signal]]

    @property
    def told(self) -> str:
        """How many of its samples are drawn; "" for all of them."""
        signals = [*self.imposed.values(), *self.measured.values()]
        drawn, samples = max(len(signal.time) for signal in signals), max(signal.samples for signal in signals)
        if drawn >= samples:
            return ""
        return f"Drawn: at most {drawn:,} of {samples:,} samples, the least and the greatest of each stretch."


def trace_of(
    rows: pd.DataFrame,
    over: Quantity,
    models: Mapping[str, pd.DataFrame],
    window: tuple[float, float] | None = None,
) -> Trace:
    """rows: of one recording, in the columns of predictions.csv; models: as many rows of each model's, in its name.
    over: the pressure of its loops. window: the stretch of time shown, with a sample more at either end."""
    if window is not None:
        time = rows[TIME].to_numpy(dtype=np.float64)
        first, last = np.searchsorted(time, window)
        inside = slice(max(int(first) - 1, 0), int(last) + 1)
        rows, models = rows.iloc[inside], {name: shown.iloc[inside] for name, shown in models.items()}
    time, used = rows[TIME].to_numpy(dtype=np.float64), usable_rows(rows)

    def signal(table: pd.DataFrame, column: str, there: np.ndarray) -> Signal:
        return Signal.drawn(time, np.where(there, table[column].to_numpy(dtype=np.float64), np.nan))

    known, every = measured_quantities(rows), np.ones(len(rows), dtype=bool)
    return Trace(
        signal(rows, over.column, every),
        {q.column: signal(rows, q.column, every) for q in pressures(rows)},
        {q.column: signal(rows, q.column, used) for q in known},
        {
            name: {q.column: signal(table, q.predicted, answered(table)) for q in known}
            for name, table in models.items()
        },
    )


def rates(time: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """How fast a recording's pressure changes, (n,) of its unit a second, without sign.

    >>> rates(np.arange(4.0), np.array([0.0, 2.0, 4.0, 6.0])).tolist()
    [2.0, 2.0, 2.0, 2.0]
    """
    around = max(1, round(AROUND * len(time)))
    place = np.arange(len(time))
    before, after = np.maximum(place - around, 0), np.minimum(place + around, len(time) - 1)
    span = time[after] - time[before]
    change = np.abs(pressure[after] - pressure[before])
    rate: np.ndarray = np.divide(change, span, out=np.zeros_like(change), where=span > 0)
    return rate


@dataclass(frozen=True)
class Loops:
    """A quantity over the pressure, of all recordings of a sample. recording: number of each point's, (n,); pressure,
    value, rate: (n,), the rate in kPa/s. fastest: the end of the scale of rates."""

    recording: np.ndarray
    pressure: np.ndarray
    value: np.ndarray
    rate: np.ndarray
    fastest: float

    @property
    def joined(self) -> np.ndarray:
        """Positions of the points from which a line goes on to the next, (m,): of one recording both."""
        return np.flatnonzero(np.diff(self.recording) == 0)

    @property
    def speed(self) -> np.ndarray:
        """The rate of each such line, (m,): the faster of both ends'."""
        fastest: np.ndarray = np.maximum(self.rate[self.joined], self.rate[self.joined + 1])
        return fastest


def loops_of(table: pd.DataFrame, over: Quantity, quantity: Quantity) -> Loops:
    """table: the rows of one sample of a log."""
    used = usable_rows(table)
    runs = run_numbers(table)
    each = max(20, LOOPED // (int(runs.max()) + 1))
    parts = []
    for run in np.unique(runs):
        rows = np.flatnonzero(runs == run)
        time, pressure, value = (table[c].to_numpy(np.float64)[rows] for c in (TIME, over.column, quantity.column))
        there = np.flatnonzero(np.isfinite(value) & used[rows])
        if len(there) < 2:
            continue
        rate = rates(time, pressure)[there]
        kept = extremes(np.stack([pressure[there], value[there]], axis=1), each)
        parts.append((np.full(len(kept), run), pressure[there][kept], value[there][kept], rate[kept]))
    if not parts:
        none = np.empty(0)
        return Loops(none, none, none, none, 1.0)
    run, pressure, value, rate = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return Loops(run, pressure, value, rate, float(np.quantile(rate, MOST)) or 1.0)


def measured_loops(table: pd.DataFrame, over: Quantity) -> dict[str, Loops]:
    """Of each measured quantity, by its column. table: as of loops_of."""
    return {q.column: loops_of(table, over, q) for q in measured_quantities(table)}


def predicted_loops(table: pd.DataFrame, over: Quantity) -> dict[str, Loops]:
    """The same of what a model says of them. table: in the columns of predictions.csv."""
    said = {q.column: table[q.predicted] for q in measured_quantities(table)}
    return {q.column: loops_of(table.assign(**said), over, q) for q in measured_quantities(table)}


def worst_recording(table: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The rows of the recording whose mean squared error is the largest, and all of its sample. table: of a log, in the
    columns of predictions.csv."""
    run = pd.Series(run_numbers(table), index=table.index)
    error = squared_error(table)
    worst = int(error.groupby(run[error.index]).mean().idxmax()) if len(error) else 0
    rows = table[(run == worst).to_numpy()]
    return rows, table[(table["sample"] == rows["sample"].iloc[0]).to_numpy()]
