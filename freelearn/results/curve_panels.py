"""What the three panels of load curves show: F–P, M–P and F–M at one kinematic state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from freelearn.measurements.states import pressure_direction
from freelearn.measurements.usable import usable_rows
from freelearn.results.formats import number
from freelearn.results.residuals import FORCE, MOMENT, Load

PRESSURE = Load("pressure_kpa", "pressure_kpa", "pressure", "P", "kPa")
COLUMNS = [PRESSURE.column, FORCE.column, MOMENT.column]
# What a reading that slipped, perhaps, is called in legends and tables.
SUSPECTED = "suspected reading"
# Beyond the other points by more than this share of their span a suspected reading is drawn at the edge.
ROOM = 0.15


class CurvePanel(NamedTuple):
    """x, y: what is drawn across and up."""

    title: str
    x: Load
    y: Load


PANELS = (
    CurvePanel("F–P", PRESSURE, FORCE),
    CurvePanel("M–P", PRESSURE, MOMENT),
    CurvePanel("F–M", FORCE, MOMENT),
)


def measured_points(measured: pd.DataFrame) -> pd.DataFrame:
    """The rows drawn, in COLUMNS, `falling` (whether the pressure fell on the way to the row) and, for each load,
    whether it is a suspected reading: usable rows and those with such a reading.

    measured: measurement columns of one kinematic state, in time order, buckled rows included: the direction is that
    of the step which led to a row; perhaps with the marks of suspects.flagged."""
    marks = {name: measured[name].to_numpy() if name in measured else False for name in (_mark(FORCE), _mark(MOMENT))}
    rows = measured[COLUMNS].assign(falling=pressure_direction(measured) < 0, **marks)
    return rows[usable_rows(measured) | rows[list(marks)].any(axis=1).to_numpy()]


def apart(points: pd.DataFrame, panel: CurvePanel) -> np.ndarray:
    """Which of measured_points a panel draws apart, (n,) bool: those where it shows a suspected reading."""
    marks = [_mark(load) for load in (panel.x, panel.y) if load is not PRESSURE]
    either: np.ndarray = points[marks].to_numpy(dtype=bool).any(axis=1)
    return either


def suspected_points(points: pd.DataFrame, curves: Mapping[str, pd.DataFrame], panel: CurvePanel) -> pd.DataFrame:
    """The points that a panel draws apart: `across` and `up`, where they are drawn; COLUMNS, what they show; `falling`.

    A reading in a wrong unit would leave the others no room: it is drawn at the edge of what they span, and `beyond`
    says what it shows ("" for one that is where it belongs)."""
    aside = apart(points, panel)
    places, beyond = {}, np.full(int(aside.sum()), "", dtype=object)
    for axis, load in (("across", panel.x), ("up", panel.y)):
        drawn = [points.loc[~aside, load.column], *(curve[load.predicted] for curve in curves.values())]
        others = np.concatenate([values.to_numpy(dtype=np.float64) for values in drawn])
        others = others[np.isfinite(others)]
        low, high = (others.min(), others.max()) if len(others) else (-np.inf, np.inf)
        room, true = ROOM * (high - low), points.loc[aside, load.column].to_numpy(dtype=np.float64)
        places[axis] = true.clip(low - room, high + room)
        text = [f"{load.symbol} = {number(value, 4)} {load.unit} " for value in true]
        beyond = np.where(places[axis] == true, beyond, beyond + np.array(text, dtype=object))
    return points.loc[aside, [*COLUMNS, "falling"]].assign(**places, beyond=beyond)


def curve_numbers(measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """What the panels show, as one table: the column `what` says measured, suspected reading, or the model's name.

    curves: frames of curve.model_curve, by the model's name."""
    points = measured_points(measured)
    suspected = points[_mark(FORCE)] | points[_mark(MOMENT)]
    rows = points[COLUMNS].assign(what=np.where(suspected, SUSPECTED, "measured"))
    names = {load.predicted: load.column for load in (FORCE, MOMENT)}
    parts = [rows, *(curve.rename(columns=names).assign(what=name) for name, curve in curves.items())]
    return pd.concat(parts, ignore_index=True)[["what", *COLUMNS, "extrapolated"]] if curves else rows


def _mark(load: Load) -> str:
    """The column that marks a load's suspected readings."""
    return f"suspect_{load.name}"
