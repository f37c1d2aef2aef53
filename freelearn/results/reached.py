"""How far a run's bed went: the plane and the pressures over which a fitted model is mapped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from freelearn.measurements.beds import ELONGATION, TWIST, Quantity
from freelearn.results.quantities import pressures

Ends = tuple[float, float]


@dataclass(frozen=True)
class Reached:
    """Lowest and highest of all samples' rows, as the bed's reach (inference.next_experiment). elongation: mm; twist:
    °; low, high: of each actuator's pressure, (k,) kPa; quantities: these pressures."""

    elongation: Ends
    twist: Ends
    quantities: tuple[Quantity, ...]
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, predictions: pd.DataFrame) -> Reached:
        """Of a run's rows: columns of predictions.csv. What was neither imposed nor measured is as predicted."""
        several = pressures(predictions)
        imposed = predictions[[quantity.column for quantity in several]].to_numpy(np.float64)
        return cls(
            _ends(predictions, ELONGATION), _ends(predictions, TWIST), several, imposed.min(axis=0), imposed.max(axis=0)
        )

    def nearest(self, elongation_mm: float, twist_deg: float) -> tuple[float, float]:
        """The place within the plane that is nearest to one."""
        ends = np.array([self.elongation, self.twist])
        near = np.clip((elongation_mm, twist_deg), ends[:, 0], ends[:, 1])
        return float(near[0]), float(near[1])


def _ends(predictions: pd.DataFrame, quantity: Quantity) -> Ends:
    for name in (quantity.column, quantity.predicted):
        if name in predictions and predictions[name].notna().any():
            return float(predictions[name].min()), float(predictions[name].max())
    return 0.0, 0.0
