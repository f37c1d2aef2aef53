"""Stresses of rubber that relaxes, integrated in small steps by SciPy, arm by arm, in NumPy."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp

Path = Callable[[float], float]
# One arm: modulus [Pa] and time [s].
Arm = tuple[float, float]


def uniaxial(stretch: float, softening: float = 0.0, exponent: float = 0.0) -> float:
    """Nominal stress of a neo-Hookean solid of modulus 1, softened or not, in uniaxial tension."""
    first = stretch**2 + 2 / stretch - 3
    return (stretch - stretch**-2) * (1 + softening * first) ** -exponent


def sheared(amount: float, softening: float = 0.0, exponent: float = 0.0) -> float:
    """Its shear stress in simple shear."""
    return amount * (1 + softening * amount**2) ** -exponent


def integrated(
    law: Callable[..., float],
    rest: float,
    arms: Sequence[Arm],
    path: Path,
    times: np.ndarray,
    soft: tuple[float, float],
) -> np.ndarray:
    """rest · law(x) + Σ qᵢ, qᵢ' = Gᵢ Q' − qᵢ/τᵢ with Q = law(x, *soft) along x(t), from rest; at times (N,), in Pa."""

    def rate(time: float, q: np.ndarray) -> np.ndarray:
        h = 1e-5
        slope = (law(path(time + h), *soft) - law(path(time - h), *soft)) / (2 * h)
        return np.array([modulus * slope - own / tau for own, (modulus, tau) in zip(q, arms, strict=True)])

    q = np.zeros(len(arms))
    found = [rest * law(path(times[0]))]
    for begin, end in pairwise(times):
        q = solve_ivp(rate, (begin, end), q, rtol=1e-9, atol=1e-9, max_step=(end - begin) / 2).y[:, -1]
        found.append(rest * law(path(end)) + q.sum())
    return np.array(found)


def ramp_and_hold(rate: float, strain: float) -> Path:
    """Amount of shear that grows from 0 and stops."""
    return lambda time: min(rate * max(time, 0.0), strain)


def recording(mode: str, name: str, time: np.ndarray, stretch: np.ndarray, stress: np.ndarray) -> pd.DataFrame:
    """Rows as read_specimens gives them, of stresses in Pa."""
    across = stretch**-0.5 if mode == "uniaxial" else np.ones_like(stretch)
    own = {"mode": mode, "specimen": name, "stretch": stretch, "stretch_2": across, "stress_mpa": stress / 1e6}
    return pd.DataFrame({**own, "stress_2_mpa": np.nan, "time_s": time})
