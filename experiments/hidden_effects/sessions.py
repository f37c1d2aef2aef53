"""Several samples that differ, as tubes of several stocks do and sensors that are set to zero anew for each.

Three samples of actuators drawn at random, each with a value of its own of something, zeros and gains of sensors among
them, or measured by a load cell whose zero wanders within its accuracy; half of the tables hide one effect of 30 σ
beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from hidden_effects.make import NOISE, sized
from scipy.signal import lfilter

from freelearn.testing.reference import literature, other_beds, truths
from freelearn.testing.reference.laboratory import random_actuators

SAMPLES, STATES, SIZE = 3, 24, 30
RISING, FALLING = np.linspace(0, 70, 5), (46.0, 23.0)
# Places go to this share of the length, and to so many degrees of an actuator as slender as the paper's.
STRETCH, TWIST_DEG, SLENDER = 0.05, 100.0, 15.6
# Of this nothing is a sample's own; and what is left of it in the next row.
WANDERS, LEFT = "a zero that wanders", 0.93
# What differs → the effects that say so, and its standard deviation: of the logarithms of C1 and C2, of zeros in the
# table's units, and of gains.
DIFFERS: dict[str, dict[str, float]] = {
    "the walls' rubber": {"wall_modulus": 0.08},
    "the fibers": {"fiber_modulus": 0.1},
    "the load cell's zeros": {"force_offset": 0.3, "moment_offset": 5.0},
    "the gauge's zero": {"pressure_offset": 1.5},
    WANDERS: {},
    "the load cell's gains": {"own_force_gain": 0.03, "own_moment_gain": 0.03},
    "the gauge's gain": {"own_pressure_gain": 0.03},
}
READ = {"force": "force_n", "moment": "moment_nmm", "pressure": "pressure_kpa"}
MEASURED = "force_n", "moment_nmm"
BESIDE = (
    *("second_invariant", "fiber_misalignment", "end_clamps", "length_offset", "force_gain", "twist_offset"),
    *("length_compliance", "friction_hysteresis", "fiber_dispersion", "moment_gain", "wall_thickness"),
)


def sessions(seeds: int) -> list[dict]:
    """Fourteen a round: of each that differs one table with nothing beside it, and one with an effect.

    shared: what all samples have of what differs, which may be told beside it: their gains are drawn about none, of the
    first one too.
    """
    jobs = []
    for seed in range(seeds):
        for place, differs in enumerate(DIFFERS):
            names = list(DIFFERS[differs])
            shared = [name.removeprefix("own_") for name in names if name.startswith("own_")]
            own = {"differs": differs, "seed": seed, "own": names, "shared": shared}
            beside = BESIDE[(5 * seed + place) % len(BESIDE)]
            jobs += [own | {"kind": "alone", "hidden": []}, own | {"kind": "beside", "hidden": [beside]}]
    return [{"number": number} | job for number, job in enumerate(jobs)]


def make(job: Mapping[str, Any]) -> pd.DataFrame:
    """The table of a job; its accuracy is NOISE."""
    material, hidden = _drawn(job)[1], {}
    for name in job["hidden"]:

        def table(amount: float, name: str = name) -> pd.DataFrame:
            return _measured(job, {name: truths.grown(name, amount)} if amount else {}, dict.fromkeys(NOISE, 0.0))

        hidden[name] = truths.grown(name, sized(table, SIZE, material, NOISE, 0.0)[0])
    return _measured(job, hidden, NOISE)


def _drawn(job: Mapping[str, Any]) -> tuple[dict[int, Any], tuple[float, float], np.random.Generator]:
    generator = np.random.default_rng([job["seed"], 2031])
    actuators = random_actuators(SAMPLES, generator)
    material = 1e6 * 2 ** generator.uniform(-1, 1), 3e7 * 2 ** generator.uniform(-1, 1)
    return actuators, material, generator


def _measured(job: Mapping[str, Any], fx: Mapping[str, Any], noise: Mapping[str, float]) -> pd.DataFrame:
    """All samples, each with what is its own."""
    actuators, (c1, c2), generator = _drawn(job)
    differs, parts = DIFFERS[job["differs"]], []
    pressures = np.r_[RISING, FALLING]
    for number, (gamma, length, inner, outer) in actuators.items():
        twist = TWIST_DEG * min(1.0, length / outer / SLENDER)
        places = generator.uniform(-1, 1, (STATES, 2)) * (STRETCH * length, twist)
        asked = other_beds.nominal(
            "kinematic", {number: (gamma, np.nan, length, inner, outer)}, places.round(2), pressures
        )
        own = {name: deviation * generator.normal() for name, deviation in differs.items()}
        part = other_beds.measure(
            "kinematic", asked, c1 * np.exp(own.get("wall_modulus", 0.0)), c2 * np.exp(own.get("fiber_modulus", 0.0)),
            fx, 10 * job["seed"] + number, noise, literature.on_the_rig,
        )  # fmt: skip
        shown = {
            column: part[column] * (1 + own.get(f"own_{what}_gain", 0.0)) + own.get(f"{what}_offset", 0.0)
            for what, column in READ.items()
        }
        if job["differs"] == WANDERS:
            shown = {name: part[name] + noise[name] * _wandering(len(part), generator) for name in MEASURED}
        parts.append(part.assign(time_s=part["time_s"] + 1e4 * number, **shown))
    return pd.concat(parts, ignore_index=True)


def _wandering(rows: int, generator: np.random.Generator) -> np.ndarray:
    """Errors (rows,) of variance one, each like the one before by LEFT."""
    before, new = generator.normal(), generator.normal(size=rows)
    errors: np.ndarray = lfilter([np.sqrt(1 - LEFT**2)], [1, -LEFT], new, zi=[LEFT * before])[0]
    return errors
