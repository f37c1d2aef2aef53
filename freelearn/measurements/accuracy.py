"""How well the bed measures."""

from __future__ import annotations

from dataclasses import dataclass

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


# The paper's bed (its Section "Testing Protocol").
PAPER = Accuracy.engineering(0.073, 0.175, 0.15, 0.03, 0.6)
