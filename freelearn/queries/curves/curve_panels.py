"""What the panels of curves show at one kinematic state: F–P, M–P and F–M, or what else the bed measures."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from freelearn.common.formats import number
from freelearn.data.beds import FORCE, MOMENT, PRESSURE, Quantity, bed_of
from freelearn.data.columns import SLACK, usable_rows
from freelearn.data.states import pressure_direction
from freelearn.queries.curves.curve_rows import measured_quantities, pressures, sweep
from freelearn.queries.curves.model_curves import ends
from freelearn.records.suspected_readings import mark

# What a reading that slipped, perhaps, and a row in which the tube hangs loose are called in legends and tables.
SUSPECTED, LOOSE = "suspected reading", "slack"
# Beyond the other points by more than this share of their span a suspected reading is drawn at the edge.
ROOM = 0.15


class CurvePanel(NamedTuple):
    """x, y: what is drawn across and up; line: the columns of both in a frame of curve.model_curve."""

    x: Quantity
    y: Quantity
    line: tuple[str, str]

    @property
    def title(self) -> str:
        """F–P has the force up and the pressure across, F–M the force across and the moment up."""
        shown = (self.y, self.x) if self.banded else (self.x, self.y)
        return "–".join(quantity.symbol for quantity in shown)

    @property
    def banded(self) -> bool:
        """Whether it has room for bands: over the pressure. With a reading on either axis a band would be an area
        along a line, of whose width nothing could be read off."""
        return self.x.unit == PRESSURE.unit


def panels_over(pressure: Quantity, measured: tuple[Quantity, ...]) -> tuple[CurvePanel, ...]:
    """Each measured quantity over the pressure, and both over each other."""
    over = [CurvePanel(pressure, q, (pressure.column, q.predicted)) for q in measured]
    both = [CurvePanel(x, y, (x.predicted, y.predicted)) for x, y in combinations(measured, 2)]
    return (*over, *both)


PANELS = panels_over(PRESSURE, (FORCE, MOMENT))


def panels_of(measured: pd.DataFrame) -> tuple[CurvePanel, ...]:
    """The panels of a state's rows: of what was measured there, or where nothing was, of what its bed measures."""
    return panels_over(sweep(measured).over, measured_quantities(measured) or bed_of(measured).measured)


def measured_points(measured: pd.DataFrame) -> pd.DataFrame:
    """The rows drawn: pressures, what the bed measures, `falling` (whether the pressure fell on the way to the row),
    `slack` (whether the tube hangs loose) and, for each quantity, whether it is a suspected reading: usable rows and
    those with such a reading.

    measured: measurement columns of one kinematic state, in time order, buckled rows included: the direction is that
    of the step which led to a row; perhaps with the marks of suspects.flagged."""
    shown = [q for q in bed_of(measured).measured if q.column in measured]
    marks = {mark(q): measured[mark(q)].to_numpy() if mark(q) in measured else False for q in shown}
    loose = measured[SLACK].to_numpy() == 1 if SLACK in measured else False
    columns = dict.fromkeys(["pressure_kpa", *(q.column for q in (*pressures(measured), *shown))])
    rows = measured[list(columns)].assign(falling=pressure_direction(measured) < 0, slack=loose, **marks)
    return rows[usable_rows(measured) | rows[list(marks)].any(axis=1).to_numpy()]


def apart(points: pd.DataFrame, panel: CurvePanel) -> np.ndarray:
    """Which of measured_points a panel draws apart, (n,) bool: those where it shows a suspected reading."""
    marks = [mark(quantity) for quantity in (panel.x, panel.y) if mark(quantity) in points]
    either: np.ndarray = points[marks].to_numpy(dtype=bool).any(axis=1)
    return either


def read(points: pd.DataFrame, panel: CurvePanel) -> np.ndarray:
    """Which of measured_points a panel draws as what was measured, (n,) bool: those with both readings, neither
    suspected nor of a tube that hangs loose."""
    there = points[[panel.x.column, panel.y.column]].notna().all(axis=1).to_numpy(dtype=bool)
    shown: np.ndarray = there & ~apart(points, panel) & ~points["slack"].to_numpy(dtype=bool)
    return shown


def loose(points: pd.DataFrame, panel: CurvePanel) -> np.ndarray:
    """Which of measured_points a panel draws as of a tube that hangs loose, (n,) bool."""
    slack: np.ndarray = points["slack"].to_numpy(dtype=bool) & ~apart(points, panel)
    return slack


def suspected_points(points: pd.DataFrame, curves: Mapping[str, pd.DataFrame], panel: CurvePanel) -> pd.DataFrame:
    """The points that a panel draws apart: `across` and `up`, where they are drawn; what they show; `falling`.

    A reading in a wrong unit would leave the others no room: it is drawn at the edge of what they span, and `beyond`
    says what it shows ("" for one that is where it belongs)."""
    aside = apart(points, panel)
    places, beyond = {}, np.full(int(aside.sum()), "", dtype=object)
    for axis, quantity, line in zip(("across", "up"), (panel.x, panel.y), panel.line, strict=True):
        drawn = [points.loc[~aside, quantity.column], *(curve[line] for curve in curves.values())]
        if axis == "up" and panel.banded:
            # At the edge of a band, not on it.
            drawn += [curve[end] for curve in curves.values() for end in ends(line) if end in curve]
        others = np.concatenate([values.to_numpy(dtype=np.float64) for values in drawn])
        others = others[np.isfinite(others)]
        low, high = (others.min(), others.max()) if len(others) else (-np.inf, np.inf)
        room, true = ROOM * (high - low), points.loc[aside, quantity.column].to_numpy(dtype=np.float64)
        places[axis] = true.clip(low - room, high + room)
        text = [f"{quantity.symbol} = {number(value, 4)}{quantity.suffix} " for value in true]
        beyond = np.where(places[axis] == true, beyond, beyond + np.array(text, dtype=object))
    return points.loc[aside].assign(**places, beyond=beyond)


def curve_numbers(measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """What the panels show, as one table: the column `what` says measured, slack, suspected reading, or the model's
    name; of a model's rows force_n_low and force_n_high are the ends of its band, where it has one.

    curves: frames of curve.model_curve, by the model's name."""
    points = measured_points(measured)
    shown = [q for q in bed_of(measured).measured if q.column in points]
    suspected = points[[mark(q) for q in shown]].any(axis=1)
    what = np.where(suspected, SUSPECTED, np.where(points["slack"], LOOSE, "measured"))
    columns = [name for name in points if str(name).startswith("pressure") or name in {q.column for q in shown}]
    rows = points[columns].assign(what=what)
    names = {q.predicted: q.column for q in shown}
    names |= dict(pair for q in shown for pair in zip(ends(q.predicted), ends(q.column), strict=True))
    parts = [rows, *(curve.rename(columns=names).assign(what=name) for name, curve in curves.items())]
    whole = pd.concat(parts, ignore_index=True)
    bands = [end for q in shown for end in ends(q.column) if end in whole]
    return whole[["what", *columns, *bands, "extrapolated"]] if curves else rows
