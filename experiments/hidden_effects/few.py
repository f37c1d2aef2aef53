"""Tables of few states: braided muscles at four to seven lengths, tubes under one to three hung loads.

Made by the reference physics, with effects of the sizes that real muscles have. A truth also gives states between those
that were measured, by which an answer is judged.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from freelearn.testing.reference import literature, other_beds
from freelearn.testing.reference.literature import FIXED
from freelearn.testing.reference.total_energy import Effects, Rig
from freelearn.testing.reference.truths import FIXED as PACKAGE_FIXED

Array = np.ndarray[Any, Any]
Draw = Callable[[np.random.Generator, float], dict[str, float]]


def _signed(generator: np.random.Generator, low: float, high: float) -> float:
    return float(generator.uniform(low, high) * generator.choice([-1, 1]))


# What a muscle of this largest force [N] may have, drawn at the sizes that real ones show.
MUSCLE: dict[str, Draw] = {
    "fiber_misalignment": lambda g, f: {"angle": _signed(g, 0.015, 0.06)},
    "end_clamps": lambda g, f: {"clamp_length": float(g.uniform(4e-3, 12e-3))},
    "end_taper": lambda g, f: {"ratio": float(g.uniform(0.6, 2.0))},
    "small_strain_stiffness": lambda g, f: {
        "modulus": float(g.uniform(0.5e6, 1.5e6)),
        "decay": float(np.exp(g.uniform(np.log(2), np.log(10)))),
    },
    "second_invariant_log": lambda g, f: {"modulus": float(g.uniform(0.4e6, 1.2e6))},
    "second_invariant": lambda g, f: {"C01": float(g.uniform(0.3e6, 1e6))},
    "bladder_stiffness": lambda g, f: {"stiffness": float(g.uniform(400, 1500))},
    "fiber_tension_only": lambda g, f: {"share": float(g.uniform(0.4, 0.95))},
    "fiber_dispersion": lambda g, f: {"kappa": float(g.uniform(0.005, 0.03))},
    "wall_thickness": lambda g, f: {"outer_radius": _signed(g, 1e-4, 3e-4)},
    "length_offset": lambda g, f: {"length": _signed(g, 0.8e-3, 3e-3)},
    "length_compliance": lambda g, f: {"compliance": float(g.uniform(0.5, 2.0) * 2e-3 / f)},
    "pressure_offset": lambda g, f: {"pressure": _signed(g, 2e3, 1e4)},
    "threshold_pressure": lambda g, f: {"pressure": float(g.uniform(1e4, 4e4))},
    "force_offset": lambda g, f: {"force": _signed(g, 0.01, 0.04) * f},
    "force_gain": lambda g, f: {"gain": _signed(g, 0.03, 0.1)},
    "pressure_gain": lambda g, f: {"gain": _signed(g, 0.03, 0.1)},
    "friction_hysteresis": lambda g, f: {"force": float(g.uniform(0.01, 0.04) * f), "moment": 0.0},
}
# The same of a tube that hangs; f is its bore's thrust under the largest pressure.
HUNG: dict[str, Draw] = {
    "fiber_misalignment": lambda g, f: {"angle": _signed(g, 0.015, 0.06)},
    "end_clamps": lambda g, f: {"clamp_length": float(g.uniform(2e-3, 8e-3))},
    "second_invariant": lambda g, f: {"C01": float(g.uniform(0.05e6, 0.3e6))},
    "wall_stiffening": lambda g, f: {"C20": float(g.uniform(0.1e6, 0.6e6))},
    "small_strain_stiffness": lambda g, f: {
        "modulus": float(g.uniform(0.2e6, 0.8e6)),
        "decay": float(g.uniform(3, 20)),
    },
    "fiber_tension_only": lambda g, f: {"share": float(g.uniform(0.4, 0.95))},
    "wall_thickness": lambda g, f: {"outer_radius": _signed(g, 1e-4, 3e-4)},
    "pressure_offset": lambda g, f: {"pressure": _signed(g, 1e3, 5e3)},
    "pressure_gain": lambda g, f: {"gain": _signed(g, 0.03, 0.1)},
    "threshold_pressure": lambda g, f: {"pressure": float(g.uniform(4e3, 15e3))},
    "twist_offset": lambda g, f: {"angle": _signed(g, 0.05, 0.2)},
    "length_offset": lambda g, f: {"length": _signed(g, 0.4e-3, 1.5e-3)},
    "force_offset": lambda g, f: {"force": _signed(g, 0.02, 0.1) * f},
    "moment_offset": lambda g, f: {"moment": _signed(g, 0.02, 0.1) * f * 5e-3},
}

# Not in the library: what happens to force and moment (N, 2) at a state; f, the largest force, and P₀ set its size.
Unknown = Callable[[dict[str, Array], Array, float, float], Array]


def _pushes(change: Callable[[dict[str, Array], Array, float], Array]) -> Unknown:
    def loads(s: dict[str, Array], at: Array, f: float, most: float) -> Array:
        x = (s["length"] - s["reference"]) / s["reference"]
        more = f * change({"x": x, "p": s["pressure"] / most}, at[:, 0] / f, f)
        return np.asarray(at + np.stack([more, 4e-3 * more], axis=1))

    return loads


UNKNOWN: dict[str, Unknown] = {
    # A bladder that folds where the muscle is short, and lets go under pressure.
    "bladder_folds": _pushes(lambda s, at, f: 0.06 * np.exp(-((s["x"] + 0.13) ** 2) / 0.03**2) * (1 - s["p"] / 2)),
    # A load cell that bends.
    "cell_bends": _pushes(lambda s, at, f: 0.12 * at * np.abs(at)),
    # A cable beside the actuator that ripples as its strands come to bear.
    "cable_ripples": _pushes(lambda s, at, f: 0.03 * np.sin(30 * s["x"]) * (1 + s["p"])),
    # A supply that chokes: what arrives falls short where much is asked for.
    "supply_chokes": _pushes(lambda s, at, f: -at * 0.25 * np.maximum(s["p"] - 0.6, 0)),
    # Threads that settle into each other beyond a pressure.
    "threads_lock": _pushes(lambda s, at, f: 0.08 * (1 + s["x"] * 4) * np.tanh((s["p"] - 0.5) / 0.1)),
}
KINDS = ("none", "one", "unknown", "several")
# Shares of the largest force, of the pressure's range and of a millimeter: the true accuracy lies within.
FORCE_SHARE, PRESSURE_SHARE, PLACE_MM = (0.001, 0.004), (0.001, 0.004), (0.05, 0.4)
# Times the largest force beyond which a force is that of a bore that jumped to an equilibrium far off, where threads
# are crushed: a muscle that is filled from rest does not get there.
JUMPED = 1.5
# Draws of the noise in a new measurement.
DRAWS = 6
MISSTATED = (1.0, 1.0, 0.5, 2.0, 1 / 3, 3.0)


@dataclass(frozen=True)
class Few:
    """A table and what is true of it. told, true: accuracies in the table's units. between: what is true,
    without noise, at states between those measured; fresh: a new measurement of these; floor: E that its noise alone
    makes. exact: the table without noise; without: the same without each hidden effect."""

    table: pd.DataFrame
    between: pd.DataFrame
    fresh: pd.DataFrame
    floor: float
    told: dict[str, float]
    true: dict[str, float]
    hidden: dict[str, dict[str, float]]
    unknown: str
    material: tuple[float, float]
    bed: str
    exact: pd.DataFrame
    without: dict[str, pd.DataFrame]


def few(seeds: int) -> list[dict]:
    """Twenty-four tables a round, six of each kind."""
    return plan(24 * seeds)


def plan(tables: int, seed: int = 2030) -> list[dict]:
    """What is hidden in each of so many tables: a quarter each nothing, one effect, an unknown one, three or four."""
    generator = np.random.default_rng([seed, 1])
    jobs = []
    for number in range(tables):
        tubes = "muscle" if number % 3 else "hung"
        kind = KINDS[number // 3 % 4]
        library = list(MUSCLE if tubes == "muscle" else HUNG)
        count = {"none": 0, "one": 1, "unknown": 0, "several": int(generator.integers(3, 5))}[kind]
        hidden = [str(name) for name in generator.choice(library, count, replace=False)]
        jobs.append({
            "number": number, "kind": kind, "tubes": tubes, "hidden": hidden,
            "unknown": str(generator.choice(list(UNKNOWN))) if kind == "unknown" else "",
            "states": int(generator.integers(4, 8) if tubes == "muscle" else generator.integers(1, 4)),
            "misstated": float(generator.choice(MISSTATED)), "seed": int(generator.integers(1 << 30)),
        })  # fmt: skip
    return jobs


def make(job: Mapping[str, Any]) -> Few:
    """The table of a job, and its states in between. A job may ask for another draw of the noise on the same design."""
    generator = np.random.default_rng(job["seed"])
    return _muscle(job, generator) if job["tubes"] == "muscle" else _hung(job, generator)


def _muscle(job: Mapping[str, Any], generator: np.random.Generator) -> Few:
    gamma, length = round(generator.uniform(21, 32), 1), float(round(generator.uniform(120, 400)))
    inner = round(generator.uniform(4, 10), 2)
    design = {1: (gamma, -gamma, length, inner, round(inner + generator.uniform(1.0, 2.0), 2))}
    material = float(1.2e6 * 2 ** generator.uniform(-1, 1)), float(2e8 * 2 ** generator.uniform(-1.5, 1.5))
    most = float(round(generator.uniform(350, 600), -1))
    rising = np.linspace(generator.uniform(0, 60), most, int(generator.integers(11, 19))).round(1)
    falling = bool(generator.integers(0, 2)) or "friction_hysteresis" in job["hidden"]
    pressures = np.r_[rising, rising[-2::-3]] if falling else rising
    deepest = -length * generator.uniform(0.12, 0.22)
    lengths = np.linspace(0.0, deepest, job["states"]).round(1)
    between = ((lengths[1:] + lengths[:-1]) / 2).round(1)
    size = other_beds.nominal("isometric", design, np.array([[0.0, 0.0]]), pressures)
    quiet = dict.fromkeys(other_beds.ACCURACY, 0.0)
    largest = float(other_beds.measure("isometric", size, *material, {}, 0, quiet)["force_n"].abs().max())
    hidden = {name: MUSCLE[name](generator, largest) for name in job["hidden"]}
    fx = {name: values | FIXED.get(name, {}) for name, values in hidden.items()}
    true = quiet | {
        "elongation_mm": float(generator.uniform(*PLACE_MM)),
        "pressure_kpa": most * float(generator.uniform(*PRESSURE_SHARE)),
        "force_n": largest * float(generator.uniform(*FORCE_SHARE)),
    }
    rig = _rig(job["unknown"], largest, most * 1e3)

    def table(places: Array, seed: int, noise: Mapping[str, float], without: str = "") -> pd.DataFrame:
        asked = other_beds.nominal("isometric", design, np.stack([places, 0 * places], axis=1), pressures)
        left = {name: values for name, values in fx.items() if name != without}
        measured = other_beds.measure("isometric", asked, *material, left, seed, noise, rig)
        jumped = measured["force_n"].abs() > JUMPED * largest
        measured = measured.assign(buckled=measured["buckled"].where(~jumped, 1))
        # A muscle that hangs loose carries nothing.
        loose = (measured["force_n"] > 0) & (asked["pressure_kpa"] < 0.7 * most)
        return measured.assign(slack=loose.astype(int), force_n=measured["force_n"].where(~loose, 0.0))

    return _few(job, table, lengths, between, true, hidden, material, "isometric", ("force_n",))


def _hung(job: Mapping[str, Any], generator: np.random.Generator) -> Few:
    gamma, length = round(generator.uniform(25, 65), 1), float(round(generator.uniform(80, 160)))
    inner = round(generator.uniform(4, 6), 2)
    outer = round(inner * generator.uniform(1.25, 1.4), 2)
    design = {1: (gamma, np.nan, length, inner, outer)}
    material = float(0.6e6 * 2 ** generator.uniform(-0.6, 0.8)), float(2e7 * 2 ** generator.uniform(-1, 1))
    most = float(round(generator.uniform(50, 90)))
    rising = np.linspace(0.0, most, int(generator.integers(16, 30))).round(2)
    pressures = np.r_[rising, rising[-2::-2]]
    thrust = np.pi * (inner * 1e-3) ** 2 * most * 1e3
    moments = np.linspace(-1, 1, job["states"]) * 1e3 * thrust * inner * 1e-3 if job["states"] > 1 else np.zeros(1)
    places = np.stack([np.zeros(job["states"]), moments.round(2)], axis=1)
    aside = np.array([[0.0, 300.0 * thrust * inner * 1e-3]])
    between = (places[1:] + places[:-1]) / 2 if len(places) > 1 else places + aside
    hidden = {name: HUNG[name](generator, thrust) for name in job["hidden"]}
    fx = {name: values | PACKAGE_FIXED.get(name, {}) for name, values in hidden.items()}
    fx |= {"small_strain_stiffness": hidden["small_strain_stiffness"]} if "small_strain_stiffness" in hidden else {}
    true = dict.fromkeys(other_beds.ACCURACY, 0.0) | {
        "elongation_mm": float(generator.uniform(0.01, 0.06)), "twist_deg": float(generator.uniform(0.1, 0.5)),
        "pressure_kpa": most * float(generator.uniform(*PRESSURE_SHARE)),
        "force_n": 0.002 * thrust, "moment_nmm": 1 * thrust * inner * 1e-3,
    }  # fmt: skip
    rig = _rig(job["unknown"], thrust, most * 1e3)

    def table(at: Array, seed: int, noise: Mapping[str, float], without: str = "") -> pd.DataFrame:
        asked = other_beds.nominal("dead_load", design, at.round(2), pressures)
        left = {name: values for name, values in fx.items() if name != without}
        return other_beds.measure("dead_load", asked, *material, left, seed, noise, rig)

    return _few(job, table, places, between, true, hidden, material, "dead_load", ("elongation_mm", "twist_deg"))


def _few(
    job: Mapping[str, Any], table: Callable[..., pd.DataFrame], places: Array, between: Array, true: dict[str, float],
    hidden: dict[str, dict[str, float]], material: tuple[float, float], bed: str, shown: tuple[str, ...],
) -> Few:  # fmt: skip
    quiet = dict.fromkeys(true, 0.0)
    noisy, exact = table(places, job.get("draw", job["seed"]), true), table(between, 0, quiet)
    without = {name: table(places, 0, quiet, name) for name in hidden}
    again = [table(between, job["seed"] + 1 + draw, true) for draw in range(DRAWS)]
    squares = []
    for fresh in again:
        good = (fresh["buckled"] == 0) & (exact["buckled"] == 0)
        missed = [(fresh[name] - exact[name])[good] / exact.loc[good, name].abs().max() for name in shown]
        squares.append(sum(float(np.mean(m**2)) for m in missed))
    told = {name: job["misstated"] * value for name, value in true.items()}
    floor = float(np.sqrt(np.mean(squares)))
    measured = table(places, 0, quiet)
    return Few(noisy, exact, again[0], floor, told, true, hidden, job["unknown"], material, bed, measured, without)


def _rig(name: str, largest: float, most: float) -> Rig:
    if not name:
        return literature.on_the_rig

    def rig(s: dict[str, Array], c1: float, c2: float, fx: Effects) -> tuple[Array, Array]:
        loads, balanced = literature.on_the_rig(s, c1, c2, fx)
        return UNKNOWN[name](s, loads, largest, most), balanced

    return rig
