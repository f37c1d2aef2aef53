"""Tables that were mapped wrongly: a sign, a unit, columns exchanged, a zero, a length, an order.

Each is a table of another plan (few states, the paper's bed, laboratories, braids), made by the reference physics, with
nothing or one effect hidden in it, and one thing done to it that intake makes easy. What has to be said of it is the
fault itself, and nothing may be claimed.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from hidden_effects import few, plan

from freelearn.common.csv_text import csv_text
from freelearn.data.beds import BED, BEDS, bed_of

Fault = Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]
KINDS = ("sign", "unit", "swapped", "untared", "length", "sorted")
DEG = np.pi / 180


def _times(factor: float, *names: str) -> Fault:
    return lambda t, g: t.assign(**{name: factor * t[name] for name in names})


def _swap(one: str, other: str) -> Fault:
    return lambda t, g: t.assign(**{one: t[other], other: t[one]})


def _zero(*names: str) -> Fault:
    """A zero that is off by 15 to 50 % of the largest reading, as that of a load cell that bears its fixture."""

    def fault(t: pd.DataFrame, g: np.random.Generator) -> pd.DataFrame:
        off = {name: float(g.uniform(0.15, 0.5) * g.choice([-1, 1]) * t[name].abs().max()) for name in names}
        return t.assign(**{name: t[name] + value for name, value in off.items()})

    return fault


def _sorted_by(*names: str, recount: bool = False) -> Fault:
    def fault(t: pd.DataFrame, g: np.random.Generator) -> pd.DataFrame:
        ordered = t.sort_values(["sample", *names], kind="stable").reset_index(drop=True)
        return _recounted(ordered) if recount else ordered.drop(columns="time_s", errors="ignore")

    return fault


def _recounted(t: pd.DataFrame) -> pd.DataFrame:
    """What intake does where nothing says which state a row belongs to: counts on while the place stays. No time."""
    bed = [q.column for q in bed_of(t).state]
    new = (t[["sample", *bed]].diff().abs().sum(axis=1) > 0).cumsum()
    return t.assign(step=t.groupby(new).cumcount()).drop(columns="time_s", errors="ignore")


# Fault → (what is done, words of which one has to be said). A "+" joins words that have to be said together.
SIGN = {
    "force_n": (_times(-1, "force_n"), ("force_n+sign", "pull")),
    "moment_nmm": (_times(-1, "moment_nmm"), ("moment_nmm+sign", "gamma_deg+sign")),
    "elongation_mm": (_times(-1, "elongation_mm"), ("elongation_mm+sign",)),
    "twist_deg": (_times(-1, "twist_deg"), ("twist_deg+sign", "gamma_deg+sign")),
    "gamma_deg": (_times(-1, "gamma_deg"), ("gamma_deg+sign",)),
}
UNIT = {
    "psi": (_times(1 / 6.894757, "pressure_kpa"), ("psi",)),
    "bar": (_times(1e-2, "pressure_kpa"), ("bar",)),
    "MPa": (_times(1e-3, "pressure_kpa"), ("MPa",)),
    "kgf": (_times(1 / 9.80665, "force_n"), ("kgf",)),
    "lbf": (_times(1 / 4.448222, "force_n"), ("lbf",)),
    "N·m": (_times(1e-3, "moment_nmm"), ("N·m",)),
    "rad": (_times(DEG, "twist_deg"), ("twist_deg+rad",)),
    "elongation in m": (_times(1e-3, "elongation_mm"), ("elongation_mm+ m", "elongation_mm+meters")),
    "elongation in inch": (_times(1 / 25.4, "elongation_mm"), ("elongation_mm+inch",)),
    "elongation in cm": (_times(0.1, "elongation_mm"), ("elongation_mm+cm",)),
}
SWAPPED = {
    "loads": (_swap("force_n", "moment_nmm"), ("force_n and moment_nmm are exchanged",)),
    "places": (_swap("elongation_mm", "twist_deg"), ("elongation_mm and twist_deg are exchanged",)),
}
UNTARED = {
    "force": (_zero("force_n"), ("not tared",)),
    "moment": (_zero("moment_nmm"), ("not tared",)),
    "both": (_zero("force_n", "moment_nmm"), ("not tared",)),
}
RADII = ("inner_radius_mm", "outer_radius_mm")
LENGTH = {
    "length in cm": (_times(0.1, "length_mm"), ("length_mm+cm", "leaves no length")),
    "length in inch": (_times(1 / 25.4, "length_mm"), ("length_mm+inch", "leaves no length")),
    "total length": (
        lambda t, g: t.assign(elongation_mm=t["elongation_mm"] + t["length_mm"]), ("total length", "stretched length"),
    ),
    "diameters": (_times(2.0, *RADII), ("diameters",)),
    "radii in inch": (_times(1 / 25.4, *RADII), ("radii+inch", "radius_mm+inch")),
    "from the circumference": (
        lambda t, g: t.assign(gamma_deg=np.sign(t["gamma_deg"]) * 90 - t["gamma_deg"]), ("circumference",),
    ),
}  # fmt: skip
SORTED = {
    "pressure": (_sorted_by("pressure_kpa"), ("sorted",)),
    "pressure, recounted": (_sorted_by("pressure_kpa", recount=True), ("sorted",)),
    "reading": (_sorted_by("force_n", recount=True), ("sorted",)),
    "within states": (
        lambda t, g: t.sort_values(["sample", *(q.column for q in bed_of(t).state), "pressure_kpa"], kind="stable")
        .reset_index(drop=True).pipe(_recounted), ("sorted",),
    ),
}  # fmt: skip
FAULTS: dict[str, Mapping[str, tuple[Fault, tuple[str, ...]]]] = {
    "sign": SIGN, "unit": UNIT, "swapped": SWAPPED, "untared": UNTARED, "length": LENGTH, "sorted": SORTED,
}  # fmt: skip
# What a bed does not read, or has only as it hangs, is mapped wrongly in other ways.
NOT_ISOMETRIC = {"moment_nmm", "twist_deg", "gamma_deg", "N·m", "rad", "loads", "moment", "both"}
NOT_HUNG = {"force_n", "kgf", "lbf", "force", "moment", "both", "loads", "reading"}
# Muscles hang loose in rows whose force then says nothing, and have both their angles turned.
NOT_BRAIDED = {"from the circumference"}
SOURCES = ("muscle", "clean", "hung", "laboratory", "braid", "clean")


def wrong(seeds: int) -> list[dict]:
    """Sixty tables a round, ten of each kind of fault, over all sources in turn."""
    jobs = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2031])
        for number in range(60):
            kind, source = KINDS[number % 6], SOURCES[(number // 6 + number) % 6]
            able = [fault for fault in FAULTS[kind] if _possible(fault, source)]
            while not able:
                source = str(generator.choice(SOURCES))
                able = [fault for fault in FAULTS[kind] if _possible(fault, source)]
            fault = able[int(generator.integers(len(able)))]
            jobs.append({"kind": kind, "source": source, "fault": fault, "seed": int(generator.integers(1 << 30))})
    return plan.numbered(jobs)


def _possible(fault: str, source: str) -> bool:
    if source in ("muscle", "braid") and fault in NOT_BRAIDED:
        return False
    if source == "hung":
        return fault not in NOT_HUNG and not fault.startswith("elongation in m")
    return source != "muscle" or fault not in NOT_ISOMETRIC


def made(job: Mapping[str, Any]) -> tuple[pd.DataFrame, dict[str, float]]:
    """The table before anything is done to it, and the accuracy that is told, in its units."""
    generator = np.random.default_rng(job["seed"])
    if job["source"] in ("muscle", "hung"):
        wanted = 1 if job["source"] == "muscle" else 0
        jobs = [j for j in few.plan(24, job["seed"]) if j["number"] % 3 == wanted and j["kind"] in ("none", "one")]
        chosen = few.make(jobs[int(generator.integers(len(jobs)))] | {"misstated": 1.0})
        return chosen.table, chosen.told
    # Imported here, because torch takes a while.
    from hidden_effects import make

    name = {"clean": "clean", "laboratory": "laboratory", "braid": "braids"}[job["source"]]
    jobs = [j for j in plan.PLANS[name](1) if _usable(j)]
    chosen = make.make(jobs[int(generator.integers(len(jobs)))] | {"seed": job["seed"]})
    told = chosen.told
    return chosen.measured.table, {
        "elongation_mm": 1e3 * told.length, "twist_deg": told.twist / DEG, "pressure_kpa": 1e-3 * told.pressure,
        "force_n": told.force, "moment_nmm": 1e3 * told.moment,
    }  # fmt: skip


def _usable(entry: Mapping[str, Any]) -> bool:
    """Whether a plan's entry gives tables that every fault can be done to."""
    whole = entry.get("protocol") != "short" and entry.get("bed", "kinematic") == "kinematic"
    return entry["kind"] in ("none", "one") and whole


def spoiled(job: Mapping[str, Any]) -> tuple[pd.DataFrame, dict[str, float]]:
    """The table as it comes out of the wrong mapping, and the accuracy."""
    table, told = made(job)
    fault, _ = FAULTS[job["kind"]][job["fault"]]
    return fault(table, np.random.default_rng([job["seed"], 1])), told


def examine_wrong(job: dict) -> dict:
    """What is said of a wrong table, and what would be claimed of it."""
    import torch

    from freelearn.common.errors import UserError
    from freelearn.data.accuracy import Accuracy
    from freelearn.data.columns import usable_rows
    from freelearn.data.table.measurement_table import read_table
    from freelearn.discovery.checks.look import failed, looked_over
    from freelearn.physics.models.build import build_model

    torch.set_num_threads(1)
    table, told = spoiled(job)
    bed = bed_of(table)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wrong.csv"
        path.write_text(csv_text(table.drop(columns=BED, errors="ignore")))
        try:
            read = read_table(path, BEDS[bed.name]).table
        except UserError as refused:
            return job | _said(job, [str(refused)]) | {"refused": True, "claim": False, "seconds": 0.0}
    seen = read[usable_rows(read)].reset_index(drop=True)
    samples = sorted(int(n) for n in seen["sample"].unique())

    def build(names: Any) -> Any:
        return build_model("continuum", {}, list(names), samples)

    accuracy = Accuracy.engineering(**{name: told[name] for name in told if name != "outer_diameter_mm"})
    began = time.perf_counter()
    found = failed(looked_over(seen, build, [], accuracy))
    seconds = time.perf_counter() - began
    result = job | _said(job, [c.says for c in found]) | {"refused": False, "seconds": seconds, "rows": len(seen)}
    return result | {"failed": [c.name for c in found], "claim": not found and _claims(seen, build, accuracy, job)}


def _said(job: Mapping[str, Any], sentences: list[str]) -> dict[str, Any]:
    _, words = FAULTS[job["kind"]][job["fault"]]
    said = any(all(part in s for part in word.split("+")) for word in words for s in sentences)
    return {"said": said, "sentences": sentences}


def _claims(table: pd.DataFrame, build: Any, accuracy: Any, job: Mapping[str, Any]) -> bool:
    """Whether the search claims anything of a table that every check lets pass."""
    from freelearn.data.rows import Rows
    from freelearn.discovery.search.search import search
    from freelearn.discovery.search.testable import question_of_rows

    rows = Rows.from_table(table)
    found = search(question_of_rows(build, table.columns, rows, accuracy, job["seed"] % 1000))
    return found.verdict in ("adequate", "named", "class", "proposed")
