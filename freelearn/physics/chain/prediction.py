"""What a model says about a configuration, alone and beside what was measured."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
import pandas as pd
from torch import Tensor

from freelearn.data.beds import bed_of
from freelearn.data.columns import usable_rows


class Status(IntEnum):
    """Why a row's loads cannot be trusted. Rows other than OK are counted, and neither fitted nor scored."""

    OK = 0
    NO_EQUILIBRIUM = 1  # no inner radius carries the pressure; the loads are those of a ballooned tube
    SINGULAR = 2  # fibers (nearly) parallel to the axis: the linear model divides by Φ + φ
    OVERSTRETCHED = 3  # longer than an inextensible fiber allows; the formula still returns a number


class Prediction(NamedTuple):
    """loads: (N, 2) force [N] and moment [N·m]; of a whole chain, what its bed measures in their place (Bed.readings),
    SI. status: (N,) uint8 values of Status."""

    loads: Tensor
    status: Tensor

    def with_loads(self, loads: Tensor) -> Prediction:
        """The same with other loads."""
        return Prediction(loads, self.status)


class SwollenPrediction(Prediction):
    """A prediction that says, too, how wide the actuator is there: diameter (N,) m."""

    diameter: Tensor

    @classmethod
    def of(cls, loads: Tensor, status: Tensor, diameter: Tensor) -> SwollenPrediction:
        """With its diameter."""
        made = cls(loads, status)
        made.diameter = diameter
        return made

    def with_loads(self, loads: Tensor) -> SwollenPrediction:
        """The same with other loads: effects that change these alone leave the shape."""
        return self.of(loads, self.status, self.diameter)


def predicted_table(table: pd.DataFrame, split: str | np.ndarray, prediction: Prediction) -> pd.DataFrame:
    """The measurement table with `split`, `status` and what is predicted; this is blank without an equilibrium.

    split: of every row, or one for all. prediction: of the table's rows.
    """
    status, bed = prediction.status.numpy(), bed_of(table)
    loads = np.where((status == Status.NO_EQUILIBRIUM)[:, None], np.nan, prediction.loads.numpy())
    words = np.array([s.name.lower() for s in Status], dtype=object)[status]
    shown = {q.predicted: loads[:, i] / q.factor for i, q in enumerate(bed.readings) if q in bed.measured}
    return table.assign(split=split, **shown, status=words)


def usable(predictions: pd.DataFrame) -> pd.DataFrame:
    """Rows that are fitted or scored: neither buckled nor left out, and with a valid prediction."""
    kept = answered(predictions)
    return predictions if kept.all() else predictions[kept]


def answered(predictions: pd.DataFrame) -> np.ndarray:
    """Which rows are `usable`, (N,) bool."""
    kept: np.ndarray = usable_rows(predictions) & (predictions["status"] == "ok").to_numpy()
    return kept
