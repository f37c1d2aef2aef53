"""The plan scattered: places that no table repeats exactly, as robots visit them and coarse encoders read them.

Random tubes and braids on four beds. Of half of the tables every row is a place of its own; of the others the pressure
goes up and down at each of some places, which an encoder reads a little otherwise in every row. Two thirds hide
nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from freelearn.testing.reference import other_beds

# Errors of what is measured, and of the gauge, as shares of the largest; of places set, mm and degrees; what an encoder
# flickers by, as a share of the range.
READ, GAUGE, SET, FLICKER = 0.003, 0.002, {"elongation_mm": 0.05, "twist_deg": 0.15}, 0.004
# What may be hidden on every bed, SI.
HIDDEN: dict[str, tuple[str, float]] = {
    "length_offset": ("length", 1e-3),
    "pressure_gain": ("gain", 0.05),
    "fiber_misalignment": ("angle", 0.03),
}
BEDS = ("kinematic", "isometric", "dead_load", "inflation")
WAYS = ("own places", "coarse encoder")


def scattered(seeds: int) -> list[dict]:
    """Seventy-two a round: nine of each bed and way, of which six hide nothing."""
    jobs = []
    for seed in range(seeds):
        for place, (bed, way) in enumerate((bed, way) for bed in BEDS for way in WAYS):
            for turn in range(9):
                hidden = [] if turn < 6 else [list(HIDDEN)[turn - 6]]
                jobs.append(
                    {
                        "kind": "one" if hidden else "none", "scattered": way, "bed": bed, "hidden": hidden,
                        "seed": 1000 * seed + 10 * place + turn,
                    }
                )  # fmt: skip
    return [{"number": number} | job for number, job in enumerate(jobs)]


def make(job: Mapping[str, Any]) -> tuple[pd.DataFrame, dict[str, float]]:
    """The table of a job, and the accuracy of its columns."""
    generator, bed = np.random.default_rng([job["seed"], 77]), job["bed"]
    braid = bed == "inflation" or (bed == "isometric" and job["seed"] % 2 == 1)
    length, inner = round(float(generator.uniform(80, 160)), 1), round(float(generator.uniform(4, 7)), 2)
    gamma = round(float(generator.uniform(22, 35) if braid else generator.uniform(25, 65)), 1)
    outer = round(inner * float(generator.uniform(1.2, 1.4)), 2)
    design = {1: (gamma, -gamma if braid else np.nan, length, inner, outer)}
    c1 = float(6e5 * 2 ** generator.uniform(-0.8, 1))
    c2, most = float(c1 * 10 ** generator.uniform(1, 2.2)), float(round(generator.uniform(200, 400) if braid else 70))
    thrust = np.pi * (inner * 1e-3) ** 2 * most * 1e3
    # From the one to the other, in the bed's units.
    low, high = {
        "kinematic": ((-0.06 * length, -70.0), (0.06 * length, 70.0)),
        "isometric": ((-0.12 * length if braid else 0.0, 0.0), (0.0 if braid else 0.05 * length, 0.0)),
        "dead_load": ((0.0, -thrust * inner), (0.0, thrust * inner)),
        "inflation": ((-0.06 * length, 0.0), (0.0, 0.0)),
    }[bed]
    own = job["scattered"] == WAYS[0]
    count = int(generator.integers(50, 90)) if own else int(generator.integers(5, 9))
    up = np.linspace(0, most, int(generator.integers(6, 10))).round(1)
    asked = other_beds.nominal(
        bed, design, generator.uniform(low, high, (count, 2)).round(2), np.zeros(1) if own else np.r_[up, up[-2::-1]]
    )
    if own:
        asked = asked.assign(pressure_kpa=generator.uniform(0, most, count).round(1), time_s=20.0 * np.arange(count))
    exact = other_beds.measure(bed, asked, c1, c2, {}, 0, dict.fromkeys(other_beds.ACCURACY, 0.0))
    right = exact["buckled"] == 0
    accuracy = other_beds.ACCURACY | SET | {"pressure_kpa": GAUGE * most}
    accuracy |= {"force_n": READ * thrust, "moment_nmm": READ * thrust * inner} if bed == "dead_load" else {}
    accuracy |= {name: READ * float(exact.loc[right, name].abs().max()) for name in other_beds.SHOWN[bed]}
    hidden = {
        name: {HIDDEN[name][0]: HIDDEN[name][1] * float(generator.choice([-1, 1]) * generator.uniform(0.8, 1.5))}
        for name in job["hidden"]
    }
    table = other_beds.measure(bed, asked, c1, c2, hidden, job["seed"], accuracy)
    table = table[table["buckled"] == 0].reset_index(drop=True)
    if own:
        return table, accuracy
    for name in other_beds.STATE[bed]:
        flicker = generator.normal(0, FLICKER * max(float(np.ptp(table[name])), 1e-9), len(table))
        table[name] = (table[name] + flicker).round(3)
    return table.drop(columns="step"), accuracy


def examine_scattered(job: dict[str, Any]) -> dict[str, Any]:
    """Makes a table, searches it, and says what came out; all JSON."""
    from hidden_effects.searched import searched

    return searched(job, *make(job))


def report_scattered(results: list[dict[str, Any]]) -> None:
    """Prints how often nothing is named where nothing hides, what hides is in the answer, and what is not right."""
    from hidden_effects.rates import answer, rate, rates_table, seconds
    from hidden_effects.searched import judged
    from rich.console import Console

    console, frame = Console(width=120), judged(results)
    rows = []
    for way in WAYS:
        none = frame[(frame["scattered"] == way) & (frame["kind"] == "none")]
        one = frame[(frame["scattered"] == way) & (frame["kind"] == "one")]
        rows += rate(f"{way}, nothing hidden: nothing claimed", none, ~none["claims"], "≥ 97")
        rows += rate(f"{way}, nothing hidden: adequate", none, none["verdict"] == "adequate", "")
        rows += rate(f"{way}, one effect: claimed", one, one["claims"] & one["there"], "")
        rows += rate(f"{way}, one effect: something else claimed", one, one["claims"] & one["more"], "≤ 3")
    console.print(rates_table(f"{len(frame)} tables, plan scattered", rows))
    missed = (frame["claims"] & frame["more"]) | ((frame["kind"] == "one") & ~frame["there"])
    for r in frame[missed].to_dict("records"):
        console.print(f"  {r['number']} {r['bed']}, {r['scattered']}: {answer(r)}", markup=False, soft_wrap=True)
    console.print(seconds(frame))
