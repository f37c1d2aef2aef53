"""What a test bed imposes and what it measures, in which units, as data: the same chain serves every bed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


MM = 1e-3  # m
DEG = math.pi / 180  # rad
KPA = 1e3  # Pa
NMM = 1e-3  # N·m

# The column by which a table says its bed; without it the bed is kinematic.
BED = "bed"


@dataclass(frozen=True)
class Quantity:
    """A quantity of the table. field: of States, where it is imposed; column: of the table; predicted: of
    predictions.csv; symbol and unit: on axes; factor: from the column's unit to SI; error: the name of its standard
    deviation in Accuracy."""

    name: str
    field: str
    column: str
    predicted: str
    symbol: str
    unit: str
    factor: float
    error: str

    @property
    def left_out(self) -> str:
        """The column of what a fit says that did not see the row's kinematic state: force_heldout_n. Its standard error
        stands in force_heldout_n_stderr."""
        return self.predicted.replace("_pred", "_heldout")

    @property
    def label(self) -> str:
        """For an axis: force F [N]."""
        return f"{self.name} {self.symbol} [{self.unit}]"

    @property
    def suffix(self) -> str:
        """The unit as it stands behind a number."""
        return behind(self.unit)


def behind(unit: str) -> str:
    """A unit as it stands behind a number; nothing behind a ratio.

    >>> behind("N"), behind("°"), behind("1")
    (' N', '°', '')
    """
    return unit if unit in ("", "°") else "" if unit == "1" else f" {unit}"


ELONGATION = Quantity("elongation", "length", "elongation_mm", "elongation_pred_mm", "Δl", "mm", MM, "length")
TWIST = Quantity("twist", "twist", "twist_deg", "twist_pred_deg", "φ", "°", DEG, "twist")
PRESSURE = Quantity("pressure", "pressure", "pressure_kpa", "pressure_pred_kpa", "P", "kPa", KPA, "pressure")
FORCE = Quantity("force", "force", "force_n", "force_pred_n", "F", "N", 1.0, "force")
MOMENT = Quantity("moment", "moment", "moment_nmm", "moment_pred_nmm", "M", "N·mm", NMM, "moment")
DIAMETER = Quantity(
    "outer diameter", "outer_diameter", "outer_diameter_mm", "outer_diameter_pred_mm", "D", "mm", MM, "diameter"
)

Pair = tuple[Quantity, Quantity]


@dataclass(frozen=True)
class Bed:
    """state: imposed once for all rows of a kinematic state, which share its errors; the pressure is imposed in each
    row. readings: the two channels of a row, each with an error of its own; measured: those that the bed has at all."""

    name: str
    state: Pair
    readings: Pair
    measured: tuple[Quantity, ...]

    @property
    def imposed(self) -> tuple[Quantity, ...]:
        """All that the bed imposes."""
        return (*self.state, PRESSURE)

    @property
    def loads(self) -> bool:
        """Whether its readings are force and moment at an imposed state: what the chain gives as it is."""
        return self.readings == (FORCE, MOMENT)


KINEMATIC = Bed("kinematic", (ELONGATION, TWIST), (FORCE, MOMENT), (FORCE, MOMENT))
ISOMETRIC = Bed("isometric", (ELONGATION, TWIST), (FORCE, MOMENT), (FORCE,))
DEAD_LOAD = Bed("dead_load", (FORCE, MOMENT), (ELONGATION, TWIST), (ELONGATION, TWIST))
INFLATION = Bed("inflation", (ELONGATION, TWIST), (FORCE, DIAMETER), (FORCE, DIAMETER))
BEDS = {bed.name: bed for bed in (KINEMATIC, ISOMETRIC, DEAD_LOAD, INFLATION)}


def bed_of(table: pd.DataFrame) -> Bed:
    """The bed that a table in the program was measured on.

    >>> import pandas as pd
    >>> bed_of(pd.DataFrame({"force_n": [1.0]})).name
    'kinematic'
    """
    return BEDS[str(table[BED].iloc[0])] if BED in table and len(table) else KINEMATIC
