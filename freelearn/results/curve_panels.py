"""What the three panels of load curves show: F–P, M–P and F–M at one kinematic state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import pandas as pd

from freelearn.measurements.states import pressure_direction
from freelearn.results.residuals import FORCE, MOMENT, Load

PRESSURE = Load("pressure_kpa", "pressure_kpa", "pressure", "P", "kPa")
COLUMNS = [PRESSURE.column, FORCE.column, MOMENT.column]


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
    """The rows drawn, un-buckled ones, in COLUMNS and `falling`: whether the pressure fell on the way to the row.

    measured: measurement columns of one kinematic state, in time order, buckled rows included: the direction is that
    of the step which led to a row."""
    falling = pressure_direction(measured) < 0
    return measured[COLUMNS].assign(falling=falling)[(measured["buckled"] == 0).to_numpy()]


def curve_numbers(measured: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """What the panels show, as one table: the column `what` says measured, or the model's name.

    curves: frames of curve.model_curve, by the model's name."""
    rows = measured.loc[measured["buckled"] == 0, COLUMNS].assign(what="measured")
    names = {load.predicted: load.column for load in (FORCE, MOMENT)}
    parts = [rows, *(curve.rename(columns=names).assign(what=name) for name, curve in curves.items())]
    return pd.concat(parts, ignore_index=True)[["what", *COLUMNS, "extrapolated"]] if curves else rows
