"""The homogeneous tests of a rubber sheet: what they are called and which stretches they impose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Mode:
    """A test at stretch λ₁ along the sheet and λ₂ across it; its thickness is free of load.

    short: in tables and commands. power: λ₂ = λ₁ ** power, None where λ₂ is imposed too and each row tells it.
    """

    name: str
    short: str
    power: float | None

    def across(self, stretch: np.ndarray) -> np.ndarray:
        """λ₂ at λ₁ (N,), both (N,); NaN where the mode leaves it to the row."""
        return np.full_like(stretch, np.nan) if self.power is None else np.power(stretch, self.power)


MODES = {
    mode.name: mode
    for mode in (
        Mode("uniaxial", "UT", -0.5),
        Mode("equibiaxial", "ET", 1.0),
        Mode("pure_shear", "PS", 0.0),
        Mode("biaxial", "BT", None),
    )
}


def mode_name(text: str) -> str | None:
    """The name of the mode that a table or a command calls `text` (uniaxial, Pure shear, UT, …), None if unknown."""
    plain = text.strip().lower().replace(" ", "_").replace("-", "_")
    return next((mode.name for mode in MODES.values() if plain in (mode.name, mode.short.lower())), None)
