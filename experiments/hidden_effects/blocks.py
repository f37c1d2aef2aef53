"""The plan blocks: two to four actuators side by side on one end block, of which no load cell reads any alone.

Helices of one kind or of several, at two to six places, filled one after another beside the others, on a grid of three
pressures each, or at random. A third hides nothing; the others an effect that all share, one of each actuator's own
size, or one that is in no library: an actuator that leaks, or a load cell that bends.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from freelearn.testing.reference import other_beds

Effects = dict[str, dict[str, float]]

NONE, SHARED, OWN, UNKNOWN = "none", "shared", "own", "unknown"
# What all actuators share, and what each has of its own: its parameter, and as much of it as is usual, SI; of pressures
# in units of the highest, of moduli in C1.
SHARES: dict[str, tuple[str, float, str]] = {
    "force_gain": ("gain", 0.06, ""),
    "length_offset": ("length", 1e-3, ""),
    "end_clamps": ("clamp_length", 3e-3, ""),
    "fiber_stiffening": ("k2", 40.0, ""),
    "wall_stiffening": ("C20", 0.3, "C1"),
    "threshold_pressure": ("pressure", 0.06, "pressure"),
}
HAS: dict[str, tuple[str, float, str]] = {
    "pressure_gain": ("gain", 0.05, ""),
    "pressure_offset": ("pressure", 0.03, "pressure"),
    "wall_thickness": ("outer_radius", 2.5e-4, ""),
    "fiber_misalignment": ("angle", 0.04, ""),
    "wall_modulus": ("log_ratio", 0.15, ""),
    "fiber_modulus": ("log_ratio", 0.3, ""),
}
LEAK, BENT = "a leak", "a cell that bends"
# What an effect changes of the largest force or moment (root mean square, C1 and C2 as they were), where up to so many
# times the usual does.
SIZES, MOST = (0.03, 0.08), 3.0
# What the one loses of the highest pressure, and by what share of the largest force the other is off there.
LOST, OFF = 0.15, 0.1
EXACT = dict.fromkeys(other_beds.ACCURACY, 0.0)
WAYS = ("in turn", "grid", "at random")
# What has one sign.
ONE_WAY = {"end_clamps", "fiber_stiffening", "wall_stiffening", "threshold_pressure"}
READ, GAUGE, SET = (0.002, 0.005, 0.01), (0.0005, 0.003), {"elongation_mm": 0.05, "twist_deg": 0.2}


def blocks(seeds: int) -> list[dict]:
    """Forty a round: twelve with nothing hidden, two of each effect, four with what is in no library."""
    each = [(NONE, "")] * 12
    each += [(kind, name) for kind, names in ((SHARED, SHARES), (OWN, HAS)) for name in names for _ in range(2)]
    each += [(UNKNOWN, name) for name in (LEAK, BENT) for _ in range(2)]
    return [
        {"number": number, "kind": kind, "block": WAYS[number % 3], "hidden": [name] if name else [], "seed": number}
        for number, (kind, name) in enumerate(each * seeds)
    ]


def _pressures(generator: np.random.Generator, way: str, count: int, most: float) -> np.ndarray:
    """Of each actuator in the rows of one place, (n, count) kPa."""
    if way == "at random":
        return np.asarray(generator.uniform(0, most, (int(generator.integers(8, 25)), count)))
    if way == "grid":
        found = np.array(list(product(np.linspace(0, most, 3), repeat=min(count, 3))))
        return np.c_[found, np.full((len(found), count - found.shape[1]), 0.3 * most)]
    beside = float(generator.choice([0.0, 0.4])) * most
    rows = [np.full(count, beside) for _ in range(5 * count)]
    for row, (actuator, pressure) in zip(rows, product(range(count), np.linspace(0, most, 5)), strict=True):
        row[actuator] = pressure
    return np.array(rows)


def make(job: Mapping[str, Any]) -> tuple[pd.DataFrame, pd.DataFrame, dict[str, float]]:
    """The table of a job, its actuators, and the accuracy of its columns."""
    generator = np.random.default_rng([job["seed"], 88])
    count, places, alike = int(generator.integers(2, 5)), int(generator.integers(2, 7)), generator.random() < 0.5
    length, inner = round(float(generator.uniform(80, 160)), 1), float(generator.uniform(3, 7))
    designs: dict[int, other_beds.Design] = {}
    gamma = generator.uniform(30, 65)
    for n in range(1, count + 1):
        own = gamma if alike else generator.uniform(30, 65) * generator.choice([-1, 1])
        radius = round(inner * (1.0 if alike else generator.uniform(0.85, 1.15)), 2)
        designs[n] = (round(float(own), 1), np.nan, length, radius, round(1.3 * radius, 2))
    c1, c2 = float(10 ** generator.uniform(5.0, 5.9)), float(10 ** generator.uniform(6.8, 8.0))
    most = float(np.clip(c1 * generator.uniform(0.3, 0.6) / 1e3, 20, 250))
    pressures = _pressures(generator, job["block"], count, most)
    place = np.stack([np.linspace(-0.04, 0.04, places) * length, generator.uniform(-50, 50, places)], axis=1)
    asked = other_beds.nominal("kinematic", {1: (np.nan,) * 5}, place.round(2), np.zeros(len(pressures)))
    asked = asked.drop(columns=[*other_beds.DESIGN_COLUMNS, "pressure_kpa"])
    names = [f"pressure_{n}_kpa" for n in designs]
    asked[names] = np.tile(pressures.round(1), (places, 1))
    exact = other_beds.measure_block(asked, designs, c1, c2, {n: {} for n in designs}, 0, EXACT)
    largest = {name: float(exact.loc[exact["buckled"] == 0, name].abs().max()) for name in ("force_n", "moment_nmm")}
    read, gauge = float(generator.choice(READ)), float(generator.choice(GAUGE))
    accuracy = other_beds.ACCURACY | SET | {"pressure_kpa": gauge * most}
    accuracy |= {name: read * size for name, size in largest.items()}
    hidden = _hidden(job, generator, designs, {"": 1.0, "C1": c1, "pressure": 1e3 * most})
    size, times = float(generator.uniform(*SIZES)), 1.0
    for _ in range(8 if job["kind"] in (SHARED, OWN) else 0):
        changed = other_beds.measure_block(asked, designs, c1, c2, _times(hidden, times), 0, EXACT)
        both = (changed["buckled"] == 0) & (exact["buckled"] == 0)
        off = max(float(((changed - exact).loc[both, name] ** 2).mean() ** 0.5) / largest[name] for name in largest)
        times = min(times * float(np.clip(size / max(off, 1e-9), 0.3, 3)), MOST)
    table = other_beds.measure_block(
        _leaking(asked, most) if LEAK in job["hidden"] else asked,
        designs, c1, c2, _times(hidden, times), job["seed"], accuracy,
    )  # fmt: skip
    if LEAK in job["hidden"]:
        table[names[0]] = asked[names[0]] + generator.normal(0, accuracy["pressure_kpa"], len(table))
    if BENT in job["hidden"]:
        table["force_n"] += OFF * table["force_n"] ** 2 / largest["force_n"]
    members = pd.DataFrame(
        [{"member": n} | dict(zip(other_beds.DESIGN_COLUMNS, d, strict=True)) for n, d in designs.items()]
    )
    table = table[table["buckled"] == 0].drop(columns="buckled").reset_index(drop=True)
    return table, members, accuracy


def _times(hidden: Mapping[int, Effects], times: float) -> dict[int, Effects]:
    """The same effects, so many times as large."""
    return {
        n: {name: {p: times * size for p, size in sizes.items()} for name, sizes in effects.items()}
        for n, effects in hidden.items()
    }


def _leaking(asked: pd.DataFrame, most: float) -> pd.DataFrame:
    """The first actuator is under less than its gauge tells, the more so the more that is."""
    told = asked["pressure_1_kpa"]
    return asked.assign(pressure_1_kpa=told * (1 - LOST * told / most))


def _hidden(
    job: Mapping[str, Any], generator: np.random.Generator, designs: Mapping[int, Any], units: Mapping[str, float]
) -> dict[int, Effects]:
    """Of each actuator, the effect that the job hides."""
    if job["kind"] not in (SHARED, OWN):
        return {n: {} for n in designs}
    (name,) = job["hidden"]
    parameter, size, unit = (SHARES if job["kind"] == SHARED else HAS)[name]
    signs = np.ones(len(designs)) if name in ONE_WAY else generator.choice([-1.0, 1.0], len(designs))
    sizes = size * units[unit] * signs
    if job["kind"] == SHARED:
        sizes[:] = sizes[0]
    else:
        sizes *= generator.uniform(0.4, 1.0, len(designs))
    return {n: {name: {parameter: float(own)}} for n, own in zip(designs, sizes, strict=True)}


def examine_block(job: dict[str, Any]) -> dict[str, Any]:
    """Makes a table, searches it, and says what came out; all JSON."""
    from hidden_effects.searched import searched

    table, members, accuracy = make(job)
    stated = {name: size for name, size in accuracy.items() if name != "outer_diameter_mm"}
    return searched(job, table, stated, members) | {"actuators": len(members)}


def report_blocks(results: list[dict[str, Any]]) -> None:
    """Prints how often nothing is named where nothing hides, what hides is in the answer, and what is not right."""
    from hidden_effects.rates import answer, rate, rates_table, seconds
    from hidden_effects.searched import judged
    from rich.console import Console

    console, frame = Console(width=120), judged(results)
    frame = frame.assign(wrong=frame["claims"] & frame["of_library"])
    none, unknown = (frame[frame["kind"] == kind] for kind in (NONE, UNKNOWN))
    rows = [
        *rate("nothing hidden: nothing claimed", none, ~none["claims"], "≥ 97"),
        *rate("nothing hidden: adequate", none, none["verdict"] == "adequate", ""),
    ]
    for kind, words in ((SHARED, "one effect that all share"), (OWN, "one effect, of each its own")):
        one = frame[frame["kind"] == kind]
        rows += rate(f"{words}: claimed", one, one["claims"] & one["there"], "")
        rows += rate(f"{words}: listed, claimed or not", one, one["there"], "")
    hiding = frame[frame["kind"] != NONE]
    rows += rate("something of the library claimed that is not there", hiding, hiding["wrong"], "≤ 3")
    rows += rate("in no library: no effect of it claimed", unknown, ~unknown["wrong"], "≥ 90")
    console.print(rates_table(f"{len(frame)} tables, plan blocks", rows))
    missed = frame["wrong"] | (frame["kind"].isin([SHARED, OWN]) & ~frame["there"])
    for r in frame[missed].to_dict("records"):
        text = f"  {r['number']} {r['actuators']} actuators, {r['block']}, {r['rows']} rows: {answer(r)}"
        console.print(text, markup=False, soft_wrap=True)
    console.print(seconds(frame))
