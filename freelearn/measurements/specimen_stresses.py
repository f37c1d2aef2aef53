"""The stresses that a specimen table holds, one for each that was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Stresses:
    """Nominal stresses [MPa] with the stretches along and across their own direction, each (N,)."""

    along: np.ndarray
    across: np.ndarray
    stress_mpa: np.ndarray

    @classmethod
    def of(cls, rows: pd.DataFrame) -> Stresses:
        """Those of direction 1, then those of direction 2, of the rows of a specimen table; blanks are left out.

        A sheet of rubber is alike in both directions: one in direction 2 is one in direction 1 of the sheet turned.
        """
        names = ("stretch", "stretch_2", "stress_mpa"), ("stretch_2", "stretch", "stress_2_mpa")
        both = np.concatenate([rows[list(columns)].to_numpy(np.float64) for columns in names])
        along, across, stress = both[~np.isnan(both[:, 2])].T
        return cls(along, across, stress)
