"""The entries of a tangent stiffness."""

from __future__ import annotations

from dataclasses import dataclass

from freelearn.units import DEG, MM, NMM


@dataclass(frozen=True)
class Rate:
    """An entry of the stiffness. column: of StiffnessMap.table; signed: whether zero is the middle of its scale."""

    name: str
    symbol: str
    column: str
    unit: str
    signed: bool = False

    @property
    def label(self) -> str:
        """For a color bar: axial stiffness −∂F/∂l [N/mm]."""
        return f"{self.name} {self.symbol} [{self.unit}]"


AXIAL = Rate("axial stiffness", "−∂F/∂l", "axial_n_per_mm", "N/mm")
TORSIONAL = Rate("torsional stiffness", "−∂M/∂φ", "torsional_nmm_per_deg", "N·mm/°")
COUPLING = Rate("coupling", "−∂F/∂φ", "coupling_n_per_deg", "N/°", signed=True)
BACK = Rate("coupling back", "−∂M/∂l", "coupling_nmm_per_mm", "N·mm/mm", signed=True)
# As ∂(F, M)/∂(l, φ) has them, row by row; and the factors of their units to SI.
RATES = (AXIAL, COUPLING, BACK, TORSIONAL)
FACTORS = (1 / MM, 1 / DEG, NMM / MM, NMM / DEG)
