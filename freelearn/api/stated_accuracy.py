"""How accurately a bed measures, as its user states it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from freelearn.common.errors import UserError

# What divides a misfit.
MEASURED = ("force_n", "moment_nmm", "outer_diameter_mm")


@dataclass(frozen=True)
class Accuracy:
    """One standard deviation of each measured quantity, in the unit that its name says; of those left out that of the
    data set, or of the paper's bed (0.073 mm, 0.175°, 0.15 kPa, 0.03 N, 0.6 N·mm, 0.02 mm).

    elongation_mm and twist_deg err once for all rows of a kinematic state, the others in each row. Raises UserError for
    what is no size.

    >>> Accuracy(force_n=0.1).stated()
    {'force_n': 0.1}
    """

    elongation_mm: float | None = None
    twist_deg: float | None = None
    pressure_kpa: float | None = None
    force_n: float | None = None
    moment_nmm: float | None = None
    outer_diameter_mm: float | None = None

    def __post_init__(self) -> None:
        for name, value in self.stated().items():
            if not math.isfinite(value) or value < 0 or (value == 0 and name in MEASURED):
                least = "more than 0" if name in MEASURED else "at least 0"
                raise UserError(f"accuracy.{name} = {value!r} is no standard deviation: choose {least}.")

    def stated(self) -> dict[str, float]:
        """Those that are given, by name. Raises UserError for one that is no number."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        try:
            return {name: float(value) for name, value in given.items() if value is not None}
        except (TypeError, ValueError):
            raise UserError("accuracy: give numbers, for example fl.Accuracy(force_n=0.1).") from None
