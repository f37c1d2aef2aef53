"""How stiff an actuator is, over the plane of its poses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from freelearn.measurements.beds import PRESSURE, Pair
from freelearn.results.quantities import pressures
from freelearn.results.stiffness_rates import AXIAL, BACK, COUPLING, FACTORS, TORSIONAL, Rate

# What differs by less than this share of the largest is the same, but for rounding.
SAME = 1e-6


@dataclass(frozen=True)
class Panel:
    """A sample's plane. name: its pressures, "" where they are a quantity of the plane; rows: its part of the table, by
    the first quantity of the plane and then the second, rising."""

    sample: int
    name: str
    rows: pd.DataFrame


@dataclass(frozen=True)
class StiffnessMap:
    """table: sample, at (lowest, middle, highest, given or within reach), elongation_mm, twist_deg, each pressure,
    pressure_kpa (of several their mean), the four RATES, least_nm_per_rad, stable, status.

    least_nm_per_rad: least eigenvalue of the stiffness, lengths counted in reference lengths. stable: 1 where that is
    positive, so that the actuator stays there under a dead load, 0 where not. All blank without an equilibrium. over:
    the two quantities of the plane: elongation and twist, or, where the bed held one of them, the other and the
    pressure. fitted: samples of the training set. notes: what a reader should know.
    """

    table: pd.DataFrame
    over: Pair
    fitted: tuple[int, ...]
    notes: tuple[str, ...]

    @property
    def rates(self) -> tuple[Rate, ...]:
        """The entries that tell something: where the model is conservative, the coupling is the same both ways."""
        if self.uncoupled:
            return AXIAL, TORSIONAL
        return (AXIAL, TORSIONAL, COUPLING) if self.symmetric else (AXIAL, TORSIONAL, COUPLING, BACK)

    @property
    def symmetric(self) -> bool:
        """Whether ∂F/∂φ = ∂M/∂l everywhere, but for rounding."""
        forth, back = self._couplings().T
        return bool(np.nanmax(np.abs(forth - back), initial=0.0) <= SAME * self._size())

    @property
    def uncoupled(self) -> bool:
        """Whether both are zero everywhere: so of a braid of two like families that is not turned."""
        return bool(np.nanmax(np.abs(self._couplings()), initial=0.0) <= SAME * self._size())

    @property
    def ats(self) -> list[str]:
        """The pressures that are told apart, in order."""
        return list(dict.fromkeys(self.table["at"]))

    def panels(self) -> Iterator[Panel]:
        """Every plane: sample by sample, and of each one the pressures."""
        for (sample, _), rows in self.table.groupby(["sample", "at"], sort=False):
            values = [f"{q.symbol} = {float(rows[q.column].iloc[0]):.3g}" for q in pressures(self.table)]
            name = "" if PRESSURE in self.over else f"{', '.join(values)} kPa".replace("-", "−")
            yield Panel(int(str(sample)), name, rows.reset_index(drop=True))

    def at(self, name: str) -> StiffnessMap:
        """The part at one of `ats`."""
        rows = self.table[self.table["at"] == name].reset_index(drop=True)
        return StiffnessMap(rows, self.over, self.fitted, self.notes)

    def _couplings(self) -> np.ndarray:
        """∂F/∂φ and ∂M/∂l, (N, 2) N."""
        values: np.ndarray = self.table[[COUPLING.column, BACK.column]].to_numpy() * (FACTORS[1], FACTORS[2])
        return values

    def _size(self) -> float:
        """What a coupling is small against, N: the geometric mean of the other two, or the coupling itself."""
        axial, torsional = (float(np.nan_to_num(self.table[r.column].abs().max())) for r in (AXIAL, TORSIONAL))
        mean = float(np.sqrt(axial * FACTORS[0] * torsional * FACTORS[3]))
        return max(mean, float(np.nanmax(np.abs(self._couplings()), initial=0.0)))
