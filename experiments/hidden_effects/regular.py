"""Regular protocols: the same pressures at the same lengths and twists, in order, on four beds, gauges of three grades.

Where steps are even the row's number tells the pressure, better than a coarse gauge does. Some tables visit each place
three times, and stand each time where they stood. A third of the tables hides one effect, of the sizes that real
actuators have; the others hide nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from hidden_effects.few import MUSCLE

from freelearn.testing.reference import literature, other_beds
from freelearn.testing.reference.literature import FIXED

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Protocol:
    """bed: its name; design: Γ, Γ₂ [deg], L, R_i, R_o [mm]; places: of each state, in the bed's units, (n, 2);
    pressures: at each, kPa; material: C1, C2 [Pa]."""

    bed: str
    design: tuple[float, float, float, float, float]
    places: Array
    pressures: Array
    material: tuple[float, float]


def _grid(lengths: list[float], twists: list[float]) -> Array:
    return np.array([(length, twist) for length in lengths for twist in twists])


PROTOCOLS = {
    "muscle, rising": Protocol(
        "isometric", (28, -28, 180, 6.0, 7.2), _grid([0, -5, -10, -15, -20], [0]),
        np.linspace(50, 500, 10), (1.2e6, 2e8),
    ),
    "muscle, up and down": Protocol(
        "isometric", (24, -24, 250, 5.0, 6.2), _grid([0, -5, -10, -15, -20, -25, -30], [0]),
        np.r_[0:601:50, 550:-1:-50], (1e6, 3e8),
    ),
    "helix, many places": Protocol(
        "kinematic", (36, np.nan, 98, 4.77, 6.7), _grid([-4, -2, 0, 2, 4], [-60, -30, 0, 30, 60]),
        np.linspace(0, 70, 8), (1.1e6, 1e7),
    ),
    "helix, few places": Protocol(
        "kinematic", (50, np.nan, 120, 4.77, 6.4), _grid([-3, 0, 3], [-40, 0, 40]), np.linspace(0, 70, 11), (1.1e6, 1e7)
    ),
    "hung tube": Protocol(
        "dead_load", (40, np.nan, 100, 5.0, 6.5), _grid([0], [-20, 0, 20]), np.linspace(0, 70, 15), (0.6e6, 2e7)
    ),
    "inflated braid": Protocol(
        "inflation", (30, -30, 60, 3.0, 4.0), _grid([0, 4, 8, 12], [0]), np.linspace(0, 30, 13), (0.3e6, 3e6)
    ),
}  # fmt: skip
# Errors of the gauge as shares of the pressures' range, of what the bed measures as shares of its largest reading,
# and of what hangs, N and N·mm.
GAUGES, SENSORS, HUNG = (0.0005, 0.003, 0.01), 0.002, {"force_n": 0.01, "moment_nmm": 0.3}
# What may be hidden on every bed.
HIDDEN = ("fiber_misalignment", "end_clamps", "second_invariant", "length_offset", "wall_thickness")


def regular(seeds: int) -> list[dict]:
    """Thirty-six a round: of each of six protocols three gauges with nothing hidden and one effect, and by the middle
    gauge three visits of each place with nothing hidden and with that effect."""
    jobs = []
    for seed in range(seeds):
        for place, protocol in enumerate(PROTOCOLS):
            none, one = (
                {"kind": "none", "hidden": []},
                {"kind": "one", "hidden": [HIDDEN[(seed + place) % len(HIDDEN)]]},
            )
            each = [none | {"gauge": gauge} for gauge in GAUGES] + [one | {"gauge": GAUGES[seed % 3]}]
            each += [job | {"gauge": GAUGES[1], "visits": 3} for job in (none, one)]
            jobs += [{"protocol": protocol, "regular": True, "visits": 1, "seed": seed} | job for job in each]
    return [{"number": number} | job for number, job in enumerate(jobs)]


def make(job: Mapping[str, Any]) -> tuple[pd.DataFrame, dict[str, float]]:
    """The table of a job, and the accuracy of its columns."""
    protocol = PROTOCOLS[job["protocol"]]
    asked = other_beds.nominal(protocol.bed, {1: protocol.design}, protocol.places, protocol.pressures)
    accuracy = other_beds.ACCURACY | {"pressure_kpa": job["gauge"] * float(np.ptp(protocol.pressures))}
    accuracy |= HUNG if protocol.bed == "dead_load" else {}

    def measured(hidden: Mapping[str, Any], errors: Mapping[str, float]) -> pd.DataFrame:
        return other_beds.measure(
            protocol.bed, asked, *protocol.material, hidden, job["seed"], errors, literature.on_the_rig
        )

    exact = measured({}, dict.fromkeys(accuracy, 0.0))
    largest = {name: float(exact[name].abs().max()) for name in other_beds.SHOWN[protocol.bed]}
    accuracy |= {name: SENSORS * value for name, value in largest.items()}
    generator = np.random.default_rng([job["seed"], 31])
    hidden = {name: MUSCLE[name](generator, max(largest.values())) | FIXED.get(name, {}) for name in job["hidden"]}
    if job["visits"] == 1:
        return measured(hidden, accuracy), accuracy
    # Where each place really is stays the same; readings err anew.
    once = measured(hidden, {n: e if n in other_beds.STATE[protocol.bed] else 0.0 for n, e in accuracy.items()})
    read, later = (*largest, "pressure_kpa"), float(once["time_s"].max()) + 20
    parts = [
        once.assign(
            time_s=once["time_s"] + visit * later,
            **{name: once[name] + generator.normal(0, accuracy[name], len(once)) for name in read},
        )
        for visit in range(job["visits"])
    ]
    return pd.concat(parts, ignore_index=True), accuracy
