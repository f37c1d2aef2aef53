"""How well the bed measures."""

from __future__ import annotations

from dataclasses import dataclass

from freelearn.data.beds import DEG, KPA, MM, NMM

# The paper's bed measures no diameter: what a camera or a laser tells.
OUTER_DIAMETER_MM = 0.02


@dataclass(frozen=True)
class Accuracy:
    """One standard deviation of the measuring, SI: length [m], twist [rad], pressure [Pa], force [N], moment [N·m],
    outer diameter [m]. What a bed imposes on a kinematic state errs once for all of its rows (length and twist, or the
    loads that hang); the pressure and what is measured err in each row."""

    length: float
    twist: float
    pressure: float
    force: float
    moment: float
    diameter: float = OUTER_DIAMETER_MM * MM

    @classmethod
    def engineering(
        cls,
        elongation_mm: float,
        twist_deg: float,
        pressure_kpa: float,
        force_n: float,
        moment_nmm: float,
        outer_diameter_mm: float = OUTER_DIAMETER_MM,
    ) -> Accuracy:
        """From the units of the measurement table.

        >>> Accuracy.engineering(0.1, 0.0, 0.15, 0.03, 0.6).pressure
        150.0
        """
        position = elongation_mm * MM, twist_deg * DEG
        return cls(*position, pressure_kpa * KPA, force_n, moment_nmm * NMM, outer_diameter_mm * MM)


# The paper's bed (its Section "Testing Protocol").
PAPER = Accuracy.engineering(0.073, 0.175, 0.15, 0.03, 0.6)
