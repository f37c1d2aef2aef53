"""Nominal stresses of rubber in the three modes, as textbooks print them (Rivlin & Saunders 1951), in NumPy."""

from pathlib import Path

import numpy as np
import pandas as pd

I1 = {
    "uniaxial": lambda x: x**2 + 2 / x,
    "equibiaxial": lambda x: 2 * x**2 + x**-4,
    "pure_shear": lambda x: x**2 + x**-2 + 1,
}
I2 = {
    "uniaxial": lambda x: 2 * x + x**-2,
    "equibiaxial": lambda x: x**4 + 2 * x**-2,
    "pure_shear": lambda x: x**2 + x**-2 + 1,
}
STRESS = {
    "uniaxial": lambda x, one, two: 2 * (x - x**-2) * (one + two / x),
    "equibiaxial": lambda x, one, two: 2 * (x - x**-5) * (one + x**2 * two),
    "pure_shear": lambda x, one, two: 2 * (x - x**-3) * (one + two),
}
ACROSS = {"uniaxial": lambda x: x**-0.5, "equibiaxial": lambda x: x, "pure_shear": np.ones_like}
SHORT = {"uniaxial": "UT", "equibiaxial": "ET", "pure_shear": "PS"}


def yeoh(mode: str, x: np.ndarray, C1: float, C20: float) -> np.ndarray:
    """Nominal stress [Pa] of Ψ = C1/2 (I₁ − 3) + C20 (I₁ − 3)²."""
    return STRESS[mode](x, C1 / 2 + 2 * C20 * (I1[mode](x) - 3), 0.0)


def gent(mode: str, x: np.ndarray, C1: float, inverse: float) -> np.ndarray:
    """Nominal stress [Pa] of Ψ = −C1 J/2 ln(1 − (I₁ − 3)/J), J = 1/inverse (Gent 1996)."""
    return STRESS[mode](x, C1 / 2 / (1 - inverse * (I1[mode](x) - 3)), 0.0)


def synthetic(C1: float, C20: float, count: int = 20) -> pd.DataFrame:
    """Noise-free tests of a Yeoh rubber in all modes."""
    x = np.linspace(1.05, 3.0, count)
    parts = [
        pd.DataFrame(
            {
                "mode": m,
                "specimen": "",
                "stretch": x,
                "stretch_2": ACROSS[m](x),
                "stress_mpa": yeoh(m, x, C1, C20) / 1e6,
                "stress_2_mpa": np.nan,
            }
        )
        for m in I1
    ]
    return pd.concat(parts, ignore_index=True)


def sources(folder: Path) -> list[str]:
    """The files of one rubber of the shared data, as the command takes them."""
    return [f"{short}={folder / short}.csv" for short in SHORT.values()]
