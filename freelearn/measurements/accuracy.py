"""How well the bed measures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from freelearn.errors import UserError
from freelearn.units import DEG, KPA, MM, NMM


@dataclass(frozen=True)
class Accuracy:
    """One standard deviation of the measuring, SI. length [m] and twist [rad] err once per kinematic state; pressure
    [Pa], force [N] and moment [N·m] err in each row."""

    length: float
    twist: float
    pressure: float
    force: float
    moment: float

    @classmethod
    def engineering(
        cls, elongation_mm: float, twist_deg: float, pressure_kpa: float, force_n: float, moment_nmm: float
    ) -> Accuracy:
        """From the units of the measurement table.

        >>> Accuracy.engineering(0.1, 0.0, 0.15, 0.03, 0.6).pressure
        150.0
        """
        return cls(elongation_mm * MM, twist_deg * DEG, pressure_kpa * KPA, force_n, moment_nmm * NMM)

    @classmethod
    def from_settings(cls, settings: Mapping[str, float]) -> Accuracy:
        """From `data.accuracy`, in its engineering units. Raises UserError."""
        names = ("elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm")
        for name in names:
            value = settings.get(name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < float("inf"):
                raise UserError(f"data.accuracy.{name} = {value!r} is not a standard deviation: give a number ≥ 0.")
        for name in ("force_n", "moment_nmm"):
            if settings[name] <= 0:
                raise UserError(f"data.accuracy.{name} must be greater than 0: no load cell is perfect.")
        return cls.engineering(**{name: settings[name] for name in names})


# The paper's bed (its Section "Testing Protocol").
PAPER = Accuracy.engineering(0.073, 0.175, 0.15, 0.03, 0.6)
