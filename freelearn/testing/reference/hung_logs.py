"""Logs of tubes that hang under a load while they are filled and vented, from the reference physics.

Where a tube rests under each pressure is searched for as on the bed of `other_beds`; between pressures splines go
through these places. What comes late does so by the small steps of `simulated_logs`. NumPy and SciPy only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from freelearn.testing.reference.other_beds import DESIGN_COLUMNS, at_rest
from freelearn.testing.reference.simulated_logs import STEPS, Array, Effects, late, swung
from freelearn.testing.reference.total_energy import KPA, MM, state_of

# Pressures at which a tube's place is searched for, and by how much these go beyond those of the log, as a share.
NODES, BEYOND = 60, 0.05
# What comes late, by what: the pressure, or the places that are seen.
SUPPLIED, SEEN = ("supply_lag", "dead_time"), ("sensor_lag", "inertia")


@dataclass(frozen=True)
class HungLog:
    """A log as measured, one standard deviation of each column in its unit, and the wall's C1 and C2 [Pa]."""

    table: pd.DataFrame
    accuracy: dict[str, float]
    material: tuple[float, float]


def hung_log(effects: Effects, seed: int, recordings: int = 6, rate: float = 5.0, seconds: float = 20.0) -> HungLog:
    """A random tube under three loads in turn, filled and vented in ramps and holds.

    effects: hidden ones with their parameters, SI: of SUPPLIED and SEEN, and any of the bed's that do not go by the
    direction of the pressure. rate: rows a second."""
    generator = np.random.default_rng([seed, 77])
    c1 = float(0.6e6 * 2 ** generator.uniform(-0.6, 0.8))
    c2 = float(c1 * 10 ** generator.uniform(1, 1.8))
    inner = round(float(generator.uniform(4, 6)), 2)
    gamma, length = round(float(generator.uniform(25, 65)), 1), round(float(generator.uniform(80, 160)), 1)
    outer = round(inner * float(generator.uniform(1.25, 1.4)), 2)
    tube = dict(zip(DESIGN_COLUMNS, (gamma, np.nan, length, inner, outer), strict=True))
    most = float(round(generator.uniform(50, 90)))
    thrust = np.pi * (inner * MM) ** 2 * most * KPA
    fine = np.arange((int(seconds * rate) - 1) * STEPS + 1) / (rate * STEPS)
    parts = []
    for run in range(1, recordings + 1):
        shown = _filled(fine, seconds, most, generator)
        load = pd.DataFrame({"sample": 1, **tube, "step": 0, "pressure_kpa": shown}, index=range(len(fine))).assign(
            run=run, time_s=fine, force_n=0.0, moment_nmm=(run % 3 - 1) * thrust * inner
        )
        places = _places(load, effects, most, c1, c2)
        rows = load.iloc[::STEPS].assign(
            elongation_mm=places[::STEPS, 0] / MM - length, twist_deg=np.rad2deg(places[::STEPS, 1])
        )
        parts.append(rows)
    table = pd.concat(parts, ignore_index=True).assign(buckled=0, bed="dead_load")
    accuracy = {
        "elongation_mm": float(generator.uniform(0.02, 0.06)), "twist_deg": float(generator.uniform(0.1, 0.5)),
        "pressure_kpa": 0.002 * most, "force_n": 0.002 * thrust, "moment_nmm": 0.002 * thrust * inner,
    }  # fmt: skip
    for name in ("elongation_mm", "twist_deg", "pressure_kpa"):
        table[name] += generator.normal(0, accuracy[name], len(table))
    return HungLog(table, accuracy, (c1, c2))


def _filled(time: Array, seconds: float, most: float, generator: np.random.Generator) -> Array:
    """Ramps between six levels, or ramps with holds between three, from rest: (n,) kPa."""
    corners = np.r_[0.0, np.sort(generator.uniform(1, seconds - 1, 6)), seconds]
    ramps, holds = generator.uniform(0.1, 1, 6), np.repeat(generator.uniform(0.1, 1, 3), 2)
    levels = np.r_[0.0, ramps if generator.random() < 0.5 else holds, generator.uniform(0, 1)]
    found: Array = np.interp(time, corners, levels * most)
    return found


def _places(load: pd.DataFrame, effects: Effects, most: float, c1: float, c2: float) -> Array:
    """Length [m] and twist [rad] that are seen at fine instants, (n, 2)."""
    time, pressure = load["time_s"].to_numpy(), load["pressure_kpa"].to_numpy()
    dt = float(time[1] - time[0])
    if "supply_lag" in effects:
        pressure = late(pressure, effects["supply_lag"]["time"], dt)
    if "dead_time" in effects:
        pressure = np.interp(time - effects["dead_time"]["delay"], time, pressure)
    nodes = np.linspace(-BEYOND * most, (1 + BEYOND) * most, NODES)
    at = load.iloc[np.zeros(NODES, dtype=int)].reset_index(drop=True).assign(pressure_kpa=nodes)
    hung = np.stack([at["force_n"], at["moment_nmm"] * MM], axis=1)
    static: Mapping[str, Any] = {name: p for name, p in effects.items() if name not in (*SUPPLIED, *SEEN)}
    # The search for a place asks for one to begin with, which is not where it rests.
    place, right = at_rest(state_of(at.assign(elongation_mm=0.0, twist_deg=0.0)), hung, c1, c2, static)
    seen = CubicSpline(nodes[right], place[right])(np.clip(pressure, nodes[right].min(), nodes[right].max()))
    if "sensor_lag" in effects:
        p = effects["sensor_lag"]
        seen = np.stack([late(x, p[name], dt) for x, name in zip(seen.T, ("force", "moment"), strict=True)], axis=1)
    if "inertia" in effects:
        p = effects["inertia"]
        each = zip(seen.T, ("force", "moment"), strict=True)
        seen = np.stack([swung(x, p[name], p["damping"], dt) for x, name in each], axis=1)
    return np.asarray(seen)
