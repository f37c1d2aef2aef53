"""Beds that are not kinematic, from the reference physics: isometric, dead load, inflation, end blocks that tilt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from freelearn.testing.reference.braided import beyond_threshold
from freelearn.testing.reference.lagging_walls import moved_on
from freelearn.testing.reference.leaning import leaned
from freelearn.testing.reference.total_energy import (
    MM,
    Array,
    Effects,
    Rig,
    bed_loads,
    on_the_rig,
    outer_diameter,
    state_of,
)

# Rounds until angles and pushes agree; each leaves less than a half of what the last one did.
ROUNDS, TILT_SETTLED = 80, 1e-13


def block_loads(
    members: Sequence[dict[str, Array]], c1: float, c2: float, fx: Effects, distance: float, angle_per_moment: float
) -> tuple[Array, Array]:
    """Loads (N, 2) on the block, and its two angles (N, 2) rad.

    members: the states of each, which stand evenly about the axis in their order. distance: of each from it [m].
    angle_per_moment: of the block's spring [rad/(N·m)].
    """
    around = 2 * np.pi * np.arange(len(members)) / len(members)
    places = distance * np.stack([np.cos(around), np.sin(around)], axis=1)
    angles = np.zeros((len(members[0]["length"]), 2))
    for _ in range(ROUNDS):
        each = [
            bed_loads(s | {"length": s["length"] + angles @ place}, c1, c2, fx)[0]
            for s, place in zip(members, places, strict=True)
        ]
        moments = sum(loads[:, :1] * place for loads, place in zip(each, places, strict=True))
        before, angles = angles, np.asarray(angle_per_moment * moments)
        if np.abs(angles - before).max() < TILT_SETTLED:
            break
    return np.asarray(sum(each)), angles


# Tables of the beds that are not kinematic, from the reference physics: isometric, dead load, inflation, end block.
#
# As in `bed`, nothing of freelearn's mechanics is used. Where an actuator comes to rest under a load is found by
# Newton's method on difference quotients of the reference's loads. NumPy only.

# Γ, Γ₂ [deg], L, R_i, R_o [mm].
Design = tuple[float, float, float, float, float]
DESIGN_COLUMNS = ("gamma_deg", "gamma2_deg", "length_mm", "inner_radius_mm", "outer_radius_mm")
# What each bed imposes on a kinematic state, and what it measures.
STATE = {
    "isometric": ("elongation_mm", "twist_deg"),
    "dead_load": ("force_n", "moment_nmm"),
    "inflation": ("elongation_mm", "twist_deg"),
    "kinematic": ("elongation_mm", "twist_deg"),
}
SHOWN = {
    "isometric": ("force_n",),
    "dead_load": ("elongation_mm", "twist_deg"),
    "inflation": ("force_n", "outer_diameter_mm"),
    "kinematic": ("force_n", "moment_nmm"),
}
# One standard deviation of each column, in its unit: the paper's, and a camera's for the diameter.
ACCURACY = {
    "elongation_mm": 0.073,
    "twist_deg": 0.175,
    "pressure_kpa": 0.15,
    "force_n": 0.03,
    "moment_nmm": 0.6,
    "outer_diameter_mm": 0.02,
}
# Newton's method: iterations, largest steps [reference lengths, rad], steps of the differences [m, rad].
ITERATIONS, LARGEST, DIFFERENCE = 120, np.array([0.03, 0.2]), np.array([1e-7, 1e-6])
SETTLED = 1e-10


def nominal(bed: str, designs: Mapping[int, Design], places: Array, pressures: Array) -> pd.DataFrame:
    """What a bed sets out to impose: each sample at each of the places (n, 2), in the bed's units, under pressures."""
    first, second = STATE[bed]
    parts = []
    for sample, design in designs.items():
        rows = len(places) * len(pressures)
        part = pd.DataFrame({"sample": sample, **dict(zip(DESIGN_COLUMNS, design, strict=True))}, index=range(rows))
        part["step"] = np.tile(np.arange(len(pressures)), len(places))
        part[first], part[second] = np.repeat(places, len(pressures), axis=0).T
        part["pressure_kpa"] = np.tile(pressures, len(places))
        part["time_s"] = 20.0 * np.arange(rows) + 10.0 * np.repeat(np.arange(len(places)), len(pressures))
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def measure(
    bed: str,
    table: pd.DataFrame,
    c1: float,
    c2: float,
    fx: Effects,
    seed: int,
    accuracy: Mapping[str, float] = ACCURACY,
    rig: Rig = on_the_rig,
) -> pd.DataFrame:
    """A table of one actuator (see `nominal`) with what its bed shows, noise included. Rows without a stable
    equilibrium are marked as buckled. rig: as in bed.bed_loads."""
    generator = np.random.default_rng([seed, 11])
    s, actual = _imposed(bed, table, accuracy, generator)
    if bed == "dead_load":
        hung = np.stack([actual["force_n"], actual["moment_nmm"] * MM], axis=1)
        place, right = at_rest(s, hung, c1, c2, fx, rig)
        shown = {"elongation_mm": (place[:, 0] - s["reference"]) / MM, "twist_deg": np.rad2deg(place[:, 1])}
    else:
        loads, right = bed_loads(s, c1, c2, fx, rig=rig)
        shown = {"force_n": loads[:, 0], "moment_nmm": loads[:, 1] / MM}
        if bed == "inflation":
            shown["outer_diameter_mm"] = outer_diameter(really(s, fx), c1, c2, fx) / MM
    return _with_noise(bed, table, shown, right, accuracy, generator)


def measure_block(
    table: pd.DataFrame,
    members: Mapping[int, Design],
    c1: float,
    c2: float,
    fx: Mapping[int, Effects],
    seed: int,
    accuracy: Mapping[str, float] = ACCURACY,
) -> pd.DataFrame:
    """A table of an end block with pressure_1_kpa …: what its members carry, each with effects of its own, adds up."""
    generator = np.random.default_rng([seed, 12])
    total, right = np.zeros((len(table), 2)), np.ones(len(table), dtype=bool)
    names = [f"pressure_{n}_kpa" for n in members]
    moved: list[Array] = []
    for n, design in members.items():
        own = table.drop(columns=names).assign(
            pressure_kpa=table[f"pressure_{n}_kpa"], **dict(zip(DESIGN_COLUMNS, design, strict=True))
        )
        s, actual = _imposed("kinematic", own, accuracy, generator if n == min(members) else None)
        if n == min(members):
            moved = [actual[name].to_numpy() - own[name].to_numpy() for name in STATE["kinematic"]]
        s["length"] = s["reference"] + own["elongation_mm"].to_numpy() * MM + moved[0] * MM
        s["twist"] = np.deg2rad(own["twist_deg"].to_numpy() + moved[1])
        own_c1, own_c2 = (
            modulus * np.exp(fx.get(n, {}).get(name, {}).get("log_ratio", 0.0))
            for name, modulus in (("wall_modulus", c1), ("fiber_modulus", c2))
        )
        loads, balanced = bed_loads(s, own_c1, own_c2, fx.get(n, {}))
        total, right = total + loads, right & balanced
    shown = {"force_n": total[:, 0], "moment_nmm": total[:, 1] / MM}
    return _with_noise("kinematic", table, shown, right, accuracy, generator, names)


def _imposed(
    bed: str, table: pd.DataFrame, accuracy: Mapping[str, float], generator: np.random.Generator | None
) -> tuple[dict[str, Array], pd.DataFrame]:
    """States (SI) as really imposed, and the table with what was; errors are those of a kinematic state."""
    actual = table.copy()
    visit = np.cumsum(table["step"].to_numpy() == 0) - 1
    if generator is not None:
        for name in STATE[bed]:
            actual[name] += generator.normal(0, accuracy[name], visit.max() + 1)[visit]
    resting = {name: 0.0 for name in ("elongation_mm", "twist_deg") if name not in table}
    s = state_of(table.assign(**resting))
    there = state_of(actual.assign(**resting))
    return s | {name: there[name] for name in ("length", "twist")}, actual


def really(s: dict[str, Array], fx: Effects) -> dict[str, Array]:
    """States that actuators really take: the bed's offsets, the gauge's errors, their lean and what they lag behind."""

    def get(name: str, p: str) -> float:
        return fx.get(name, {}).get(p, 0.0)

    imposed = s | {
        "length": s["length"] + get("length_offset", "length"),
        "twist": s["twist"] + get("twist_offset", "angle"),
        "pressure": s["pressure"] * (1 + get("pressure_gain", "gain"))
        + get("pressure_offset", "pressure")
        - get("pressure_hysteresis", "pressure") * s["direction"],
    }
    return beyond_threshold(moved_on(leaned(imposed, fx), fx), fx)


def at_rest(
    s: dict[str, Array], hung: Array, c1: float, c2: float, fx: Effects, rig: Rig = on_the_rig
) -> tuple[Array, Array]:
    """Length and twist (N, 2) m, rad at which the loads are those hung (N, 2), and whether that is stable, (N,)."""
    size = np.stack([s["reference"], np.ones(len(hung))], axis=1)
    q = np.stack([s["reference"], np.zeros(len(hung))], axis=1)

    def loads(at: Array) -> Array:
        return bed_loads(s | {"length": at[:, 0], "twist": at[:, 1]}, c1, c2, fx, rig=rig)[0]

    for _ in range(ITERATIONS):
        excess = loads(q) - hung
        slopes = [(loads(q + h) - loads(q - h)) / (2 * h.sum()) for h in np.diag(DIFFERENCE)]
        stiffness = -np.stack(slopes, axis=2)
        step = np.linalg.solve(stiffness, excess[..., None])[..., 0] / size
        if (np.abs(step) < SETTLED).all():
            break
        q = q + size * np.clip(step, -LARGEST, LARGEST)
    stable = (np.linalg.det(stiffness) > 0) & (np.trace(stiffness, axis1=1, axis2=2) > 0)
    _, balanced = bed_loads(s | {"length": q[:, 0], "twist": q[:, 1]}, c1, c2, fx, rig=rig)
    return q, (np.abs(step) < SETTLED).all(1) & stable & balanced


def _with_noise(
    bed: str, table: pd.DataFrame, shown: Mapping[str, Any], right: Array, accuracy: Mapping[str, float],
    generator: np.random.Generator, pressures: Sequence[str] = ("pressure_kpa",),
) -> pd.DataFrame:  # fmt: skip
    table = table.copy()
    for name in pressures:
        table[name] += generator.normal(0, accuracy["pressure_kpa"], len(table))
    for name in SHOWN[bed]:
        table[name] = shown[name] + generator.normal(0, accuracy[name], len(table))
    return table.assign(buckled=(~right).astype(int), **({} if bed == "kinematic" else {"bed": bed}))
