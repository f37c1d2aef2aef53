"""The plans time, held and hung: logs with hidden effects of the history, and what the search says of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from freelearn.testing.reference.simulated_logs import C1, C2, DRIFTING, POSITION, SENSORS, STATIC, UNIT, UNKNOWN, log

# Sizes in σ after refitting C1 and C2; of what is hidden together, and of what no library has.
SIZES, TOGETHER, UNKNOWN_SIZE, DRIFTED_SIZE = (8, 15, 30), 30, 100, 30
# Correlations of the noise of neighboring rows, drawn at random.
MEMORIES = (0.0, 0.0, 0.8)
# What tells the size of an effect; all else is how it acts.
SIZED = {
    "maxwell_slip": ("share",),
    "contact_slip": ("share",),
    "creep": ("share",),
    "supply_lag": ("time",),
    "dead_time": ("delay",),
    "sensor_lag": ("force", "moment"),
    "valve_flow": ("squared_resistance",),
    "gas_warming": ("time",),
    "inertia": ("force", "moment"),
    "stress_softening": ("depth",),
}
MOST = 0.95
# What shows in the force of an actuator that is held (creep does not: its fibers let no wall move), beside what;
# and the samples.
HELD = ("maxwell_slip", "contact_slip", "supply_lag", "dead_time", "sensor_lag", "valve_flow", "gas_warming")
SHOWN_HELD = ("force_gain", "pressure_gain", "force_offset", "length_offset")
STIFF_TO_SOFT = (1, 3, 4, 5, 6, 8)
# Of what drifts, what is in the library.
KNOWN_AS = {"drifting force zero, linear": "sensor_drift"}
# Rounds of sizing, and by how much one may change the amount.
ROUNDS, STRIDE = 6, 30.0
TIMES = (
    "creep.time",
    "supply_lag.time",
    "dead_time.delay",
    "sensor_lag.force",
    "sensor_lag.moment",
    "inertia.force",
    "inertia.moment",
    "gas_warming.time",
    "gas_warming.cooling",
)


def over_time(seeds: int) -> list[dict]:
    """Single effects of the history, pairs of them and with a static effect, what is in no library, and none: kind,
    hidden effects, size in σ, sample, correlation of the noise, and seed."""
    sets: list[dict] = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2032])
        hidden: list[tuple[str, list[str], int]] = [("none", [], 0)] * 12
        hidden += [("one", [name], size) for name in UNIT for size in SIZES]
        together = [pair for pair in product(UNIT, [*UNIT, *STATIC]) if pair[0] < pair[1] or pair[1] in STATIC]
        picked = sorted(generator.choice(len(together), 12, replace=False))
        hidden += [("pair", list(together[k]), TOGETHER) for k in picked]
        hidden += [("unknown", [name], UNKNOWN_SIZE) for name in UNKNOWN]
        hidden += [("drift", [name], DRIFTED_SIZE) for name in DRIFTING]
        for kind, names, size in hidden:
            s = {"kind": kind, "hidden": names, "size": size, "recordings": 10}
            s |= {"sample": int(generator.choice([3, 4, 5])), "memory": float(generator.choice(MEMORIES))}
            sets.append(s | {"seed": int(generator.integers(1 << 30))})
    return [s | {"number": number} for number, s in enumerate(sets)]


def held(seeds: int) -> list[dict]:
    """The same on a bed that holds length and twist and measures the force alone, with actuators from stiff to soft:
    the gauge's noise is from a tenth to all of what the force scatters by."""
    sets: list[dict] = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2048])
        hidden: list[tuple[str, list[str], int]] = [("none", [], 0)] * 12
        hidden += [("one", [name], size) for name in HELD for size in SIZES[1:]]
        hidden += [("pair", [name, other], TOGETHER) for name, other in zip(HELD, SHOWN_HELD, strict=False)]
        for kind, names, size in hidden:
            s = {"kind": kind, "hidden": names, "size": size, "recordings": 8, "bed": "isometric", "memory": 0.0}
            sets.append(s | {"sample": int(generator.choice(STIFF_TO_SOFT)), "seed": int(generator.integers(1 << 30))})
    return [s | {"number": number} for number, s in enumerate(sets)]


def hung(seeds: int) -> list[dict]:
    """Tubes that hang while they are filled and vented, seen by a camera: what comes late, as large as laboratories
    meet it, alone and beside a gain of the gauge."""
    sets: list[dict] = []
    for seed in range(seeds):
        generator = np.random.default_rng([seed, 2054])
        hidden: list[tuple[str, list[str]]] = [("none", [])] * 8
        hidden += [("one", [name]) for name in HUNG for _ in range(4)]
        hidden += [("pair", [name, "pressure_gain"]) for name in HUNG]
        for kind, names in hidden:
            drawn = {name: (HUNG | {"pressure_gain": _gain})[name](generator) for name in names}
            s = {"kind": kind, "hidden": names, "size": 0, "recordings": 6, "bed": "dead_load", "memory": 0.0}
            sets.append(s | {"amounts": drawn, "sample": 1, "seed": int(generator.integers(1 << 30))})
    return [s | {"number": number} for number, s in enumerate(sets)]


def _gain(generator: np.random.Generator) -> dict[str, float]:
    return {"gain": float(generator.uniform(0.03, 0.06) * generator.choice([-1, 1]))}


def _swing(generator: np.random.Generator) -> dict[str, float]:
    force, moment = (float(generator.uniform(0.3, 0.8)) for _ in range(2))
    return {"force": force, "moment": moment, "damping": float(generator.uniform(0.1, 0.3))}


# What comes late to a hung tube, or to whoever looks at it.
HUNG: dict[str, Callable[[np.random.Generator], dict[str, float]]] = {
    "supply_lag": lambda g: {"time": float(g.uniform(0.15, 0.8))},
    "dead_time": lambda g: {"delay": float(g.uniform(0.15, 0.5))},
    "sensor_lag": lambda g: {"force": float(g.uniform(0.15, 0.5)), "moment": float(g.uniform(0.15, 0.5))},
    "inertia": _swing,
}


def amounts(name: str, a: float) -> dict[str, float]:
    """An effect's parameters at `a` times a noticeable one, SI."""
    known = UNIT | STATIC | UNKNOWN | DRIFTING
    sized = SIZED.get(name, tuple(known[name]))
    grown = {label: a * value if label in sized else value for label, value in known[name].items()}
    return {label: min(value, MOST) if label in ("share", "depth") else value for label, value in grown.items()}


def make_time(job: dict) -> tuple[pd.DataFrame, dict[str, dict[str, float]], list[float]]:
    """The job's log, what is hidden in it with its parameters, SI, and the size of each in σ."""

    def table(fx: dict[str, dict[str, float]], noise: float) -> pd.DataFrame:
        bed = job.get("bed")
        made = log(
            fx, job["seed"], (job["sample"],), job["recordings"], noise=noise, memory=job["memory"], moves=bed is None
        )
        return made if bed is None else made.drop(columns="moment_nmm").assign(bed=bed)

    plain = table({}, 0.0)
    size_of = sizes(plain, job["memory"])
    hidden, reached = {}, []
    for name in job["hidden"]:
        a, now = 1.0, size_of(table({name: amounts(name, 1.0)}, 0.0))
        for _ in range(ROUNDS):
            a *= float(np.clip(job["size"] / max(now, 1e-9), 1 / STRIDE, STRIDE))
            now = size_of(table({name: amounts(name, a)}, 0.0))
            if abs(now / job["size"] - 1) < 0.05:
                break
        hidden[name] = amounts(name, a)
        reached.append(now)
    return table(hidden, 1.0), hidden, reached


def sizes(plain: pd.DataFrame, memory: float) -> Any:
    """What tells how many σ a noiseless table is from the plain one, after refitting C1 and C2: by a dense covariance
    of every recording."""
    import torch

    from freelearn.data.rows import Rows
    from freelearn.discovery.noise.noise import sensitivities
    from freelearn.fitting.problem import Problem
    from freelearn.physics.models.build import build_model

    rows = Rows.from_table(plain)
    model = build_model("continuum", {"C1": C1, "C2": C2})
    slopes = sensitivities(model, rows.states).numpy()
    jacobian = Problem(model, rows, torch.ones(2).double()).jacobians(model.vector()[None].detach())[0]
    # What the bed does not measure tells nothing.
    measured = rows.readings.present.any(0).numpy()
    each, slopes = jacobian.reshape(len(rows), 2, -1).numpy()[:, measured], slopes[:, measured]
    noises = np.array([SENSORS[1], SENSORS[2] * 1e-3])[measured]
    roots = {}
    for run in np.unique(rows.state):
        own = np.flatnonzero(rows.state == run)
        apart = np.abs(np.subtract.outer(np.arange(len(own)), np.arange(len(own))))
        fades = memory**apart if memory else np.eye(len(own))
        place = slopes[own][:, :, :2] * (POSITION[0] * 1e-3, np.deg2rad(POSITION[1]))
        gauge = slopes[own][:, :, 2] * SENSORS[0] * 1e3
        covariance = np.einsum("ick,jdk->icjd", place, place)
        covariance += np.einsum("ic,jd,ij->icjd", gauge, gauge, fades)
        for channel, sigma in enumerate(noises):
            covariance[:, channel, :, channel] += sigma**2 * fades
        roots[run] = own, np.linalg.cholesky(covariance.reshape(len(noises) * len(own), -1))

    def white(columns: np.ndarray) -> np.ndarray:
        parts = [np.linalg.solve(root, columns[own].reshape(len(root), -1)) for own, root in roots.values()]
        return np.concatenate(parts)

    span = np.linalg.qr(white(each))[0]

    def size_of(table: pd.DataFrame) -> float:
        change = white((Rows.from_table(table).loads - rows.loads).numpy()[:, measured])
        return float(np.linalg.norm(change - span @ (span.T @ change)))

    return size_of


def examine_time(job: dict) -> dict:
    """The job with the verdict, the effects named, what each may be taken for, which intervals hold, and seconds."""
    import torch
    from hidden_effects.examine import covered
    from hidden_effects.examine_few import as_read

    from freelearn.data.accuracy import PAPER, Accuracy
    from freelearn.data.rows import Rows
    from freelearn.discovery.checks.look import failed, looked_over
    from freelearn.discovery.search.search import search
    from freelearn.discovery.search.testable import question_of_rows
    from freelearn.physics.models.build import build_model
    from freelearn.testing.reference.hung_logs import hung_log

    torch.set_num_threads(1)
    if "amounts" in job:
        made = hung_log(job["amounts"], job["seed"])
        fx, reached, (c1, c2) = job["amounts"], [0.0 for _ in job["hidden"]], made.material
        table, accuracy = as_read(made.table, job["bed"]), Accuracy.engineering(**made.accuracy)
    else:
        table, fx, reached = make_time(job)
        accuracy, c1, c2 = PAPER, C1, C2
    began = time.perf_counter()
    rows = Rows.from_table(table)

    def build(names: Any) -> Any:
        return build_model("continuum", {}, list(names), [job["sample"]])

    result = job | {"reached": reached, "truth": fx}
    try:
        stopped = [check.name for check in failed(looked_over(table, build, [], accuracy))]
        found = search(question_of_rows(build, table.columns, rows, accuracy, job["seed"] % 1000))
    except Exception as problem:  # a failure is a result too
        reason = f"{type(problem).__name__}: {problem}"
        return result | {
            "verdict": "failed",
            "reason": reason,
            "named": [],
            "classes": [],
            "covered": {},
            "seconds": 0.0,
        }
    truth = {"C1": c1, "C2": c2} | {f"{name}.{p}": v for name, values in fx.items() for p, v in values.items()}
    right = set(found.effects) == set(job["hidden"])
    scatter = found.final.whiten.scatter
    memory = None if scatter is None else scatter.memory
    return result | {
        "verdict": "undecided" if stopped else found.verdict,
        "claimed": found.claimed,
        "named": found.effects,
        "classes": [list(c) for c in found.classes],
        "covered": covered(found, truth) if right else {},
        "fades": None if memory is None else memory.time.tolist(),
        "failed": [*stopped, *(check.says for check in (found.referee.failed if found.referee else []))],
        "seconds": time.perf_counter() - began,
    }


def report_time(results: list[dict]) -> None:
    """Prints, by kind and size, how often the right effect was named, alone or in a class of three or fewer; and which
    intervals hold."""
    print(f"{'kind':8}{'σ':>4}{'sets':>6}{'right':>8}   verdicts")
    for kind, size in sorted({(r["kind"], r["size"]) for r in results}):
        own = [r for r in results if (r["kind"], r["size"]) == (kind, size)]
        right = sum(map(is_right, own))
        verdicts = {v: sum(r["verdict"] == v for r in own) for v in sorted({r["verdict"] for r in own})}
        print(f"{kind:8}{size:>4g}{len(own):>6}{right / len(own):>8.0%}   {verdicts}")
    held = [(label, held) for r in results for label, held in r["covered"].items()]
    times = [hold for label, hold in held if label in TIMES]
    for what, holds in (("all parameters", [hold for _, hold in held]), ("time constants", times)):
        if holds:
            print(f"95 % intervals of {what} that hold: {np.mean(holds):.1%} of {len(holds)}")
    took = [r["seconds"] for r in results]
    print(f"seconds: median {np.median(took):.0f}, most {max(took):.0f}")
    for r in results:
        if not is_right(r):
            sizes = ", ".join(f"{size:.0f}" for size in r["reached"])
            print(
                f"  {r['number']}: hidden {r['hidden']} ({sizes} σ, correlation {r['memory']:g}), {r['verdict']}: "
                f"{r['classes']} {r.get('reason', '')} {'; '.join(r.get('failed', []))}"
            )


def is_right(result: dict) -> bool:
    """Whether what is hidden was named, each by itself or within a class of at most three, and nothing else; of what is
    in no library, whether nothing of it was named, though it may have been written."""
    claims = result["verdict"] in ("named", "class", "proposed")
    if result["verdict"] == "failed":
        return False
    if result["kind"] in ("unknown", "drift"):
        known = [KNOWN_AS.get(hidden, "") for hidden in result["hidden"]] == result["named"]
        return result["verdict"] != "adequate" and (known or not claims or result["verdict"] == "proposed")
    if not result["hidden"]:
        return not claims
    if len(result["named"]) != len(result["hidden"]) or not claims:
        return False
    classes = [set(members) for members in result["classes"]]
    return all(any(h in c and len(c) <= 3 for c in classes) for h in result["hidden"])
