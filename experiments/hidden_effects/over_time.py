"""The plan time: logs with hidden effects of the history, by small steps of integration, and what the search says."""

from __future__ import annotations

import time
from itertools import combinations

import numpy as np

from freelearn.testing.reference.logs import UNIT

# Times a noticeable effect that is hidden.
SIZES = (0.5, 1.0, 2.0)
# What tells the size of an effect; all else is how it acts.
SIZED = {
    "maxwell_slip": ("share",),
    "contact_slip": ("share",),
    "creep": ("share",),
    "supply_lag": ("time",),
    "dead_time": ("delay",),
    "sensor_lag": ("force", "moment"),
}
MOST = 0.95


def over_time(seeds: int) -> list[dict]:
    """Single effects, pairs and none: kind, hidden effects with their parameters, size, samples and seed."""
    sets: list[dict] = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2032])
        hidden: list[tuple[str, list[str], float]] = [("none", [], 0.0)] * 6
        hidden += [("one", [name], size) for name in UNIT for size in SIZES]
        hidden += [("pair", list(pair), 1.0) for pair in combinations(UNIT, 2)][::3]
        for kind, names, size in hidden:
            s = {"kind": kind, "hidden": names, "size": size, "recordings": 10}
            sets.append(s | {"sample": int(generator.choice([3, 4, 5])), "seed": int(generator.integers(1 << 30))})
    return [s | {"number": number} for number, s in enumerate(sets)]


def values(names: list[str], size: float) -> dict[str, dict[str, float]]:
    """The hidden effects' parameters, SI."""
    grown = {}
    for name in names:
        each = dict(UNIT[name])
        for label in SIZED[name]:
            each[label] = min(size * each[label], MOST) if label == "share" else size * each[label]
        grown[name] = each
    return grown


def examine_time(job: dict) -> dict:
    """The job with the verdict, the effects named, what each may be taken for, and seconds."""
    import freelearn as fl
    from freelearn.testing.reference.logs import log

    table = log(values(job["hidden"], job["size"]), job["seed"], (job["sample"],), job["recordings"])
    began = time.perf_counter()
    found = fl.discover(table, progress=False)
    seconds = time.perf_counter() - began
    return job | {"verdict": found.verdict, "named": found.effects, "classes": found.classes, "seconds": seconds}


def report_time(results: list[dict]) -> None:
    """Prints, by kind and size, how often the right effect was named, alone or in a class of three or fewer."""
    print(f"{'kind':6}{'size':>6}{'sets':>6}{'right':>8}{'verdicts':>12}")
    for kind, size in sorted({(r["kind"], r["size"]) for r in results}):
        own = [r for r in results if (r["kind"], r["size"]) == (kind, size)]
        right = sum(map(is_right, own))
        verdicts = {v: sum(r["verdict"] == v for r in own) for v in sorted({r["verdict"] for r in own})}
        print(f"{kind:6}{size:>6g}{len(own):>6}{right / len(own):>8.0%}   {verdicts}")
    took = [r["seconds"] for r in results]
    print(f"seconds: median {np.median(took):.0f}, most {max(took):.0f}")
    for r in results:
        if not is_right(r):
            print(f"  {r['number']}: hidden {r['hidden']} × {r['size']:g}, {r['verdict']}: {r['named']} {r['classes']}")


def is_right(result: dict) -> bool:
    """Whether what is hidden was named, each by itself or within a class of at most three, and nothing else."""
    named = result["named"]
    if len(named) != len(result["hidden"]):
        return False
    classes = [{name, *(members or [])} for name, members in zip(named, result["classes"], strict=True)]
    return all(any(h in c and len(c) <= 3 for c in classes) for h in result["hidden"])
