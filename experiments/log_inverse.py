"""python experiments/log_inverse.py: do bands along a log hold what was read in recordings that were left out?

For effects of the history, hidden in logs by small steps of integration (freelearn.testing.reference.simulated_logs), a
model is fitted to six recordings of 10 s. Counted are the forces and moments of others within the bands predicted for
them; and, where their forces, noise and all, are the wishes, the pressures and moments that were read there.
"""

from __future__ import annotations

import argparse
import logging

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

import freelearn as fl
from freelearn.testing.reference.simulated_logs import UNIT, log

ASKED = ["sample", "time_s", "run", "elongation_mm", "twist_deg", "force_n"]
STATED = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
NAMES = ("", "supply_lag", "sensor_lag", "dead_time", "creep", "maxwell_slip", "contact_slip")


def held(name: str, seed: int, asked: argparse.Namespace) -> list[float]:
    """Shares within their bands: of forces and moments predicted, of pressures found and of the moments there; half of
    the pressures' (median) and their miss (rms), kPa."""
    effects = {name: UNIT[name]} if name else {}
    fitted = log(effects, seed, recordings=asked.fitted, rate=10.0, seconds=10.0, memory=asked.memory)
    run = fl.fit(fitted, effects=list(effects), accuracy=STATED, seed=seed, progress=False)
    read = log(effects, 1000 + seed, recordings=asked.others, rate=10.0, seconds=10.0, memory=asked.memory)
    told = run.predict(read)
    missed = np.abs(told.loads - read[["force_n", "moment_nmm"]].to_numpy() * (1.0, 1e-3))
    shares = list((missed <= told.half).mean(0))
    if not asked.wished:
        return [*shares, *[np.nan] * 4]
    few = read[read["run"] <= asked.wished]
    found = run.invert(few[ASKED]).frame()
    answered = np.isfinite(found["pressure_kpa_low"])
    shares += [
        float(few[column].between(found[f"{column}_low"], found[f"{column}_high"])[answered].mean())
        for column in ("pressure_kpa", "moment_nmm")
    ]
    half = (found["pressure_kpa_high"] - found["pressure_kpa_low"])[answered].median() / 2
    return [*shares, float(half), float(((found["pressure_kpa"] - few["pressure_kpa"])[answered] ** 2).mean() ** 0.5)]


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="fits of each kind")
    parser.add_argument("--fitted", type=int, default=6, help="recordings that a fit sees")
    parser.add_argument("--others", type=int, default=20, help="recordings left out of each, that are predicted")
    parser.add_argument("--wished", type=int, default=3, help="of these, whose forces are wished for; 0: none")
    parser.add_argument("--memory", type=float, default=0.0, help="correlation of neighboring rows' noise")
    parser.add_argument("--only", choices=NAMES, action="append")
    asked = parser.parse_args()
    torch.set_num_threads(1)
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    shown = Table(
        "hidden", "forces predicted", "moments", "pressures found", "moments there", "half band, kPa", "rms miss, kPa",
        title=f"Shares within 95 % bands, {asked.seeds} fits each",
    )  # fmt: skip
    for name in asked.only or NAMES:
        each = [held(name, seed, asked) for seed in range(asked.seeds)]
        *within, half, miss = np.mean(each, axis=0)
        told = [*(f"{share:.1%}" for share in within), f"{half:.2f}", f"{miss:.2f}"]
        shown.add_row(name or "nothing (no memory)", *(told if asked.wished else told[:2]))
    Console(width=140).print(shown)


if __name__ == "__main__":
    main()
