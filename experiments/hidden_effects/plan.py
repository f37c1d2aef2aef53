"""What is hidden in which data set."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from hidden_effects.smooth import WORD

from freelearn.testing.reference.laboratory import KINDS
from freelearn.testing.reference.truths import BRAIDED, MOVED, OUTSIDE, UNIT

SAMPLES = (2, 3, 4, 5, 6, 7, 8)
SIZES = (4, 8, 15, 30)
# Of what is hidden together, and of what protocols of a special kind are tried on [σ].
TOGETHER = 15
LABORATORY_SIZES, SMOOTH_SIZES = (8, 15, 30), (15, 30, 80)
# What may be hidden beside something of a braid, on every bed.
WITH_BRAIDS = ("end_clamps", "length_offset", "length_compliance", "pressure_offset", "force_offset", "force_gain")
# What may be taken for an effect of how the bed moves, or that for it.
LIKE_MOVED = {
    "off_axis": ("twist_offset", "moment_gain", "sensor_crosstalk", "fiber_misalignment"),
    "viscoelasticity": ("length_offset", "relaxation", "sensor_drift", "stress_softening"),
}
FRICTION, LAG, RUB = "friction_hysteresis", "pressure_hysteresis", "motion_friction"
# Protocols of their own: ladders from above rest, several readings at each pressure, sweeps of the length.
BEGUN = ("from above rest", "several readings", "isobaric")
# Laboratories whose noise is normal, that have slips, and that are odd in another way.
NORMAL_SHARE, SLIPPED_SHARE, ODD_SHARE = 0.5, 2 / 3, 0.2


def clean(seeds: int) -> list[dict]:
    """The paper's actuators and protocol, normal noise as stated: kind, what is hidden, its size in σ after refitting,
    samples, noise factor, seed."""
    sets: list[dict] = []
    names = list(UNIT)
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2024])
        for _ in range(8):
            sets.append({"kind": "none", "hidden": [], "size": 0})
        for name in names:
            for size in SIZES:
                sets.append({"kind": "one", "hidden": [name], "size": size})
        for name in OUTSIDE:
            for size in (15, 30):
                sets.append({"kind": "outside", "hidden": [name], "size": size})
        pairs = list(combinations(names, 2))
        for k in generator.choice(len(pairs), 15, replace=False):
            sets.append({"kind": "pair", "hidden": list(pairs[k]), "size": TOGETHER})
        for s in sets:
            if "seed" not in s:
                count = 2 if s["kind"] != "none" or generator.random() < 0.7 else int(generator.choice([1, 3, 8]))
                s["samples"] = sorted(int(n) for n in generator.choice(SAMPLES, min(count, 7), replace=False))
                s["seed"] = int(generator.integers(1 << 30))
                s["noise"] = 1.0 if generator.random() < 0.8 else float(generator.choice([0.5, 2.0]))
    return numbered(sets)


def laboratory(seeds: int) -> list[dict]:
    """Random actuators, measured as laboratories measure: beside what `clean` says, the protocol (standard, short or
    sorted), the actuators and the settings of `laboratory.Laboratory`."""
    sets = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2025])
        for protocol, kind, hidden, size in _hidden(generator):
            s = {"kind": kind, "hidden": hidden, "size": size, "protocol": protocol}
            s["seed"] = int(generator.integers(1 << 30))
            sets.append(s | {"noise": 1.0, "laboratory": settings(protocol, generator)})
    return numbered(sets)


def _hidden(generator: np.random.Generator) -> Iterator[tuple[str, str, list[str], int]]:
    """Protocol, kind, what is hidden and its size."""
    names = list(UNIT)
    for _ in range(20):
        yield "standard", "none", [], 0
    for name in names:
        for size in LABORATORY_SIZES:
            yield "standard", "one", [name], size
    for count, kind in ((2, "pair"), (3, "triple")):
        together = list(combinations(names, count))
        for k in generator.choice(len(together), 15, replace=False):
            yield "standard", kind, list(together[k]), TOGETHER
    for name in OUTSIDE:
        for size in (15, 30):
            yield "standard", "outside", [name], size
    for protocol in ("short", "sorted"):
        for _ in range(10):
            yield protocol, "none", [], 0
        for name in names:
            yield protocol, "one", [name], TOGETHER


def braids(seeds: int) -> list[dict]:
    """What braided muscles taught, hidden in helices and in braids, which two beds measure: beside what `clean` says,
    the tubes ("helix" or "braid") and the bed. In pairs with what every tube may have."""
    sets: list[dict] = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2026])
        for tubes, bed in (("helix", "kinematic"), ("braid", "kinematic"), ("braid", "isometric")):
            hidden: list[tuple[str, list[str], int]] = [("none", [], 0)] * 6
            hidden += [("one", [name], size) for name in BRAIDED for size in LABORATORY_SIZES]
            hidden += [("pair", [name, str(generator.choice(WITH_BRAIDS))], TOGETHER) for name in BRAIDED]
            for kind, names, size in hidden:
                s = {"kind": kind, "hidden": names, "size": size, "tubes": tubes, "bed": bed, "noise": 1.0}
                sets.append(s | {"seed": int(generator.integers(1 << 30))})
    return numbered(sets)


def moves(seeds: int) -> list[dict]:
    """Actuators that lean and walls that lag behind, as `laboratory` measures: alone, beside what they may be taken
    for, and this without them."""
    sets: list[dict] = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2027])
        hidden: list[tuple[str, str, list[str], int]] = [("standard", "none", [], 0)] * 8
        hidden += [("standard", "one", [name], size) for name in MOVED for size in LABORATORY_SIZES]
        hidden += [("sorted", "none", [], 0)] * 4 + [("sorted", "one", [name], TOGETHER) for name in MOVED]
        for name, others in LIKE_MOVED.items():
            hidden += [("standard", "one", [other], TOGETHER) for other in others]
            hidden += [("standard", "pair", [name, other], TOGETHER) for other in others]
        for protocol, kind, names, size in hidden:
            s = {"kind": kind, "hidden": names, "size": size, "protocol": protocol}
            s["seed"] = int(generator.integers(1 << 30))
            sets.append(s | {"noise": 1.0, "laboratory": settings(protocol, generator)})
    return numbered(sets)


def unknown(seeds: int) -> list[dict]:
    """Misfits that nobody had in mind, random smooth functions of place and pressure, as `laboratory` measures: a third
    each in few states, in sorted ones and in such as usual."""
    sets = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2028])
        for number in range(24):
            protocol = ("standard", "short", "sorted")[number % 3]
            s = {"kind": "outside", "hidden": [f"{WORD} {24 * seed + number}"], "size": SMOOTH_SIZES[number // 3 % 3]}
            s |= {"seed": int(generator.integers(1 << 30)), "noise": 1.0, "protocol": protocol}
            sets.append(s | {"laboratory": settings(protocol, generator)})
    return numbered(sets)


def directions(seeds: int) -> list[dict]:
    """What goes by the direction of the pressure, in few states as `laboratory` measures: friction where the pressure
    only rises, which these rows cannot show, beside nothing hidden there; friction, and regulators that stay short of
    their setpoint or gauges that lag, where it falls too; friction in ladders that begin above rest, and where each
    pressure is read several times; friction against the bed's motion under one pressure after the other."""
    sets = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2032])
        hidden: list[tuple[str, str, list[str], int]] = [("rising", "none", [], 0)] * 6
        hidden += [(protocol, "none", [], 0) for protocol in BEGUN for _ in range(3)]
        friction = [(protocol, FRICTION) for protocol in ("rising", "both ways", *BEGUN[:2])]
        for protocol, name in (*friction, ("both ways", LAG), (BEGUN[2], RUB)):
            hidden += [(protocol, "one", [name], size) for size in LABORATORY_SIZES for _ in range(3)]
        for protocol, kind, names, size in hidden:
            s = {"kind": kind, "hidden": names, "size": size, "protocol": protocol, "noise": 1.0}
            s |= {"seed": int(generator.integers(1 << 30)), "laboratory": settings("short", generator)}
            if protocol not in ("rising", BEGUN[2]):
                s["laboratory"] |= {"pressures": 6, "falling": int(generator.integers(2, 6))}
            if protocol == BEGUN[0]:
                s["laboratory"]["begins"] = float(generator.uniform(5, 25))
            elif protocol == BEGUN[1]:
                s["laboratory"]["readings"] = int(generator.integers(2, 4))
            elif protocol == BEGUN[2]:
                own = {"states": int(generator.integers(7, 15)), "pressures": int(generator.integers(3, 7))}
                s["laboratory"] |= own | {"isobaric": True}
            sets.append(s)
    return numbered(sets)


def settings(protocol: str, generator: np.random.Generator) -> dict:
    """How a laboratory measures, drawn at random: arguments of Laboratory that are not its own; all JSON."""
    chosen: dict = {"order": "sorted"} if protocol == "sorted" else {}
    if protocol == "short":
        chosen |= {"states": int(generator.integers(6, 41)), "pressures": int(generator.integers(3, 9)), "falling": 0}
    tails, slipped, growth, misstated = (generator.random() for _ in range(4))
    if tails > NORMAL_SHARE:
        chosen["tails"] = 4.0
    if slipped < SLIPPED_SHARE:
        chosen["slipped"] = float(generator.choice([0.002, 0.01, 0.01, 0.03]))
        if generator.random() < ODD_SHARE:
            chosen["kinds"] = list(KINDS)
    if growth < ODD_SHARE:
        chosen["growth"] = float(generator.uniform(1, 2))
    if misstated < ODD_SHARE:
        chosen["misstated"] = float(generator.choice([1 / 3, 3.0]))
    return chosen


def numbered(sets: list[dict]) -> list[dict]:
    """The data sets with the numbers that their files have."""
    return [s | {"number": number} for number, s in enumerate(sets)]


def some(jobs: list[dict], most: int | None) -> list[dict]:
    """At most so many data sets, spread over the plan."""
    if not most or most >= len(jobs):
        return jobs
    return [jobs[k] for k in sorted(np.random.default_rng(0).permutation(len(jobs))[:most])]


PLANS = {
    "clean": clean, "laboratory": laboratory, "braids": braids, "moves": moves, "unknown": unknown,
    "directions": directions,
}  # fmt: skip
