"""python experiments/log_inverse.py [SEEDS]: do bands of pressures found along a log hold those that were read?

For effects of the history, hidden in logs by small steps of integration (freelearn.testing.reference.simulated_logs), a
model is fitted to six recordings of 10 s; three others' forces, noise and all, are the wishes. What is counted are the
pressures, and the moments, that were read there.
"""

from __future__ import annotations

import logging
import sys

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

import freelearn as fl
from freelearn.testing.reference.simulated_logs import UNIT, log

ASKED = ["sample", "time_s", "run", "elongation_mm", "twist_deg", "force_n"]
STATED = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
NAMES = ("", "supply_lag", "sensor_lag", "dead_time", "creep", "maxwell_slip", "contact_slip")


def held(name: str, seed: int) -> list[float]:
    """Shares of the pressures and moments within their bands, half of the pressures' (median) and their miss (rms),
    kPa."""
    effects = {name: UNIT[name]} if name else {}
    fitted = log(effects, seed, recordings=6, rate=10.0, seconds=10.0)
    run = fl.fit(fitted, effects=list(effects), accuracy=STATED, seed=seed, progress=False)
    read = log(effects, 100 + seed, recordings=3, rate=10.0, seconds=10.0)
    found = run.invert(read[ASKED]).frame()
    told = np.isfinite(found["pressure_kpa_low"])
    shares = [
        float(read[column].between(found[f"{column}_low"], found[f"{column}_high"])[told].mean())
        for column in ("pressure_kpa", "moment_nmm")
    ]
    half = (found["pressure_kpa_high"] - found["pressure_kpa_low"])[told].median() / 2
    return [*shares, float(half), float(((found["pressure_kpa"] - read["pressure_kpa"])[told] ** 2).mean() ** 0.5)]


def main(seeds: int) -> None:
    """Runs the command."""
    torch.set_num_threads(1)
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    shown = Table(
        "hidden", "pressures within", "moments within", "half band, kPa", "rms miss, kPa", title=f"{seeds} logs each"
    )
    for name in NAMES:
        pressure, moment, half, miss = np.mean([held(name, seed) for seed in range(seeds)], axis=0)
        shown.add_row(name or "nothing (no memory)", f"{pressure:.1%}", f"{moment:.1%}", f"{half:.2f}", f"{miss:.2f}")
    Console(width=120).print(shown)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
