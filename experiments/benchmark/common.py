"""What the benchmarks share."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import torch

ROOT = Path(__file__).resolve().parents[2]

from freelearn.data.rows import Rows  # noqa: E402
from freelearn.physics.simulated_bed import simulate  # noqa: E402

ACCURACY = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
FIELDS = ("fiber_angle", "reference_length", "inner_radius", "outer_radius", "length", "twist", "pressure")
# what, measured, target, detail
Report = Callable[..., None]


def timed(call: Callable[[], object], repeats: int = 5) -> float:
    """Median seconds of a call after one to warm up."""
    call()
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - began)
    return statistics.median(seconds)


def table(effects: dict | None = None) -> pd.DataFrame:
    """The virtual bed of a continuum tube whose fibers go slack."""
    return simulate({"C1": 1e6, "C2": 4e7}, effects or {"fiber_tension_only": {"share": 0.7}}, ACCURACY, 0.45, seed=0)


def rows_of(part: pd.DataFrame) -> Rows:
    """Its un-buckled rows."""
    rows = Rows.from_table(part)
    return rows[torch.as_tensor(np.flatnonzero(part["buckled"] == 0))]


def bed() -> Rows:
    """Un-buckled rows of sample 3."""
    whole = table()
    return rows_of(whole[whole["sample"] == 3])
