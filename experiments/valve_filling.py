"""python experiments/valve_filling.py FOLDER: does a valve's flow tell how a muscle fills, and better than a lag?

FOLDER holds fillings of a muscle from a constant supply (Experiment1Fill.csv and so on, of Muscle_Sensory: time_s,
pressure_kpa). Of each the supply, the pressure at the start, and the time r V of the valve with its critical ratio, or
the time of a lag, are fitted; the error is the root mean square over the filling, as a share of the supply.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from rich.console import Console
from scipy.optimize import least_squares

from freelearn.data.beds import KPA
from freelearn.physics.effects.history.valve_flow import ATMOSPHERE, filled

Form = Callable[..., np.ndarray]
# Seconds of a filling; what is left of it then is the gauge's.
LONGEST = 12.0


def valve(time: np.ndarray, supply: float, begun: float, slow: float, critical: float) -> np.ndarray:
    """Pressure (N,) kPa behind a valve, from what it begins with to the supply's. slow: r V [s]."""
    air = ATMOSPHERE / KPA
    before, source = (torch.full((len(time),), p + air, dtype=torch.float64) for p in (begun, supply))
    ratio = torch.tensor(critical, dtype=torch.float64)
    return filled(before, source, torch.as_tensor(time / slow), ratio).numpy() - air


def lagging(time: np.ndarray, supply: float, begun: float, slow: float) -> np.ndarray:
    """The same of a lag with this time [s]."""
    return supply - (supply - begun) * np.exp(-time / slow)


def fitted(form: Form, time: np.ndarray, pressure: np.ndarray, start: list[float]) -> tuple[float, np.ndarray]:
    """Root mean square of what a form leaves of a filling (N,), as a share of the supply, and its parameters."""
    most = float(pressure.max())
    bounds = [0.9 * most, -50.0, 0.02, 0.02][: len(start)], [1.1 * most, 0.6 * most, 20.0, 0.48][: len(start)]
    fit = least_squares(lambda p: form(time, *p) - pressure, np.clip(start, *bounds), bounds=bounds)
    return float(np.sqrt(np.mean(fit.fun**2)) / most), fit.x


def main(folder: Path) -> None:
    """Runs the command."""
    console = Console(width=120)
    console.print(f"{'':18}{'valve':>8}{'r V, s':>9}{'b':>6}{'lag':>9}{'τ, s':>8}")
    for path in sorted(folder.glob("Experiment*Fill.csv")):
        raw = pd.read_csv(path).query("time_s < @LONGEST")
        time, pressure = raw["time_s"].to_numpy(), raw["pressure_kpa"].to_numpy()
        start = [float(pressure.max()), float(pressure[0])]
        flows, (_, _, slow, critical) = fitted(valve, time, pressure, [*start, 2.0, 0.3])
        lags, (_, _, tau) = fitted(lagging, time, pressure, [*start, 1.0])
        console.print(f"{path.stem:18}{flows:>8.2%}{slow:>9.2f}{critical:>6.2f}{lags:>9.2%}{tau:>8.2f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
