"""python experiments/hidden_effects: how well hidden effects are found, on data of a bed apart from the package.

Prints, writes to outputs/hidden_effects and plots recovery against size, the confusion matrix, false alarms, coverage
of the 95 % intervals and time. Data sets already done are not done again.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import combinations
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from rich.progress import track

from freelearn.files import write_text

SAMPLES = (2, 3, 4, 5, 6, 7, 8)
NOISE = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
SIZES = (4, 8, 15, 30)


def plan(seeds: int) -> list[dict]:
    """Every data set: kind, what is hidden, its size in σ after refitting, samples, noise factor, seed."""
    from freelearn.testing.reference.truths import OUTSIDE, UNIT

    sets = []
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
            sets.append({"kind": "pair", "hidden": list(pairs[k]), "size": 15})
        for s in sets:
            if "seed" not in s:
                count = 2 if s["kind"] != "none" or generator.random() < 0.7 else int(generator.choice([1, 3, 8]))
                s["samples"] = sorted(int(n) for n in generator.choice(SAMPLES, min(count, 7), replace=False))
                s["seed"] = int(generator.integers(1 << 30))
                s["noise"] = 1.0 if generator.random() < 0.8 else float(generator.choice([0.5, 2.0]))
    for number, s in enumerate(sets):
        s["number"] = number
    return sets


def examine(job: dict) -> dict:
    """Makes one data set, searches it, and says what came out."""
    import torch

    torch.set_num_threads(1)
    from freelearn.inference.covariance import parameter_covariance
    from freelearn.inference.hysteresis import rising_falling
    from freelearn.inference.question import Question
    from freelearn.inference.reciprocity import reciprocity
    from freelearn.inference.search import search
    from freelearn.inference.testable import candidates
    from freelearn.measurements.accuracy import Accuracy
    from freelearn.measurements.rows import Rows
    from freelearn.measurements.states import States, kinematic_state, measured_loads
    from freelearn.models.build import build_model
    from freelearn.testing.reference.bed import measure
    from freelearn.testing.reference.truths import grown, outside

    generator = np.random.default_rng(job["seed"])
    material = float(1e6 * 2 ** generator.uniform(-1, 1)), float(3e7 * 2 ** generator.uniform(-1, 1))
    noise = {name: value * job["noise"] for name, value in NOISE.items()}
    amounts = [amount(job, [name], material, noise) for name in job["hidden"]]
    fx, extra = {}, None
    if job["kind"] == "outside":
        extra = outside(job["hidden"][0], amounts[0])
    else:
        fx = {name: grown(name, a) for name, a in zip(job["hidden"], amounts, strict=True)}
    table = measure(job["samples"], *material, fx, noise, job["seed"], extra=extra)
    began = time.perf_counter()
    usable = torch.as_tensor(np.flatnonzero(table["buckled"] == 0))
    rows = Rows(States.from_table(table), measured_loads(table), kinematic_state(table))[usable]

    def build(names):
        return build_model("continuum", {}, names, job["samples"])

    library, _ = candidates(build([]), [], table.columns, rows)
    try:
        question = Question(build, library, rows, Accuracy.engineering(**noise), job["seed"] % 1000)
        found = search(question)
    except Exception as problem:  # a failure is a result too
        return job | {
            "verdict": "failed",
            "reason": f"{type(problem).__name__}: {problem}",
            "effects": [],
            "classes": [],
        }
    first, last = found.steps[0], found.final
    screens = [
        rising_falling(first.fit.raw_residual, found.rows.states, found.rows.state, first.whiten),
        reciprocity(first.fit.residual, first.fit.jacobian, found.rows.states, first.whiten),
    ]
    truth = {"C1": material[0], "C2": material[1]}
    truth |= {f"{name}.{p}": v for name, values in fx.items() for p, v in values.items()}
    covered = {}
    if set(found.effects) == set(job["hidden"]) and job["kind"] != "outside":
        deviation = np.sqrt(np.diagonal(parameter_covariance(last)))
        for (label, value), error in zip(last.fit.values().items(), deviation, strict=True):
            whole = label.split("[")[0]
            if whole in truth:
                covered[label] = bool(abs(value - truth[whole]) <= 1.96 * error)
    return job | {
        "verdict": found.verdict,
        "effects": found.effects,
        "classes": [list(c) for c in found.classes],
        "truth": truth,
        "screens": {screen.name: screen.shows for screen in screens},
        "hysteresis_at_most": screens[0].at_most,
        "before": first.E_heldout,
        "after": last.E_heldout,
        "floor": last.floor,
        "covered": covered,
        "rows": len(rows),
        "seconds": time.perf_counter() - began,
    }


def amount(job: dict, names: list[str], material: tuple[float, float], noise: dict) -> float:
    """How many units of the effect make it as large as asked, in σ after refitting C1 and C2: from noise-free data."""
    import torch

    from freelearn.fit.problem import Problem
    from freelearn.inference.linear_algebra import orthonormal
    from freelearn.inference.noise import Whitener, sensitivities
    from freelearn.measurements.accuracy import Accuracy
    from freelearn.measurements.rows import Rows
    from freelearn.measurements.states import States, kinematic_state, measured_loads
    from freelearn.models.build import build_model
    from freelearn.testing.reference.bed import measure
    from freelearn.testing.reference.truths import grown, outside

    silent = dict.fromkeys(NOISE, 0.0)

    def loads(a: float):
        if job["kind"] == "outside":
            return measure(job["samples"], *material, {}, silent, job["seed"], extra=outside(names[0], a))
        return measure(job["samples"], *material, {names[0]: grown(names[0], a)} if a else {}, silent, job["seed"])

    plain = loads(0.0)
    rows = Rows(States.from_table(plain), measured_loads(plain), kinematic_state(plain))
    model = build_model("continuum", {"C1": material[0], "C2": material[1]})
    whiten = Whitener(sensitivities(model, rows.states), torch.as_tensor(rows.state), Accuracy.engineering(**noise))
    jacobian = Problem(model, rows, torch.ones(2).double()).jacobians(model.vector()[None].detach())[0]
    span = orthonormal(whiten(jacobian.reshape(len(rows), 2, -1)).flatten(0, 1))
    usable = torch.as_tensor(plain["buckled"].to_numpy() == 0)

    def size(a: float) -> float:
        change = measured_loads(loads(a)) - rows.loads
        white = whiten(torch.where(usable[:, None], change, 0.0)).reshape(-1)
        return float((white - span @ (span.T @ white)).norm())

    a = 1.0
    for _ in range(4):
        a *= min(max(job["size"] / max(size(a), 1e-9), 1e-3), 1e3)
    return a


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=1, help="rounds of the whole plan, about 139 data sets each")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--most", type=int, help="stop after this many data sets, spread over the plan")
    parser.add_argument("--out", type=Path, default=Path("outputs/hidden_effects"))
    arguments = parser.parse_args()
    jobs = plan(arguments.seeds)
    if arguments.most:
        chosen = np.random.default_rng(0).permutation(len(jobs))[: arguments.most]
        jobs = [jobs[k] for k in sorted(chosen)]
    arguments.out.mkdir(parents=True, exist_ok=True)
    todo = [job for job in jobs if not (arguments.out / f"{job['number']}.json").exists()]
    with ProcessPoolExecutor(arguments.workers) as pool:
        for result in track(pool.map(examine, todo), total=len(todo), description="data sets"):
            write_text(arguments.out / f"{result['number']}.json", json.dumps(result) + "\n")
    from hidden_effects.verdicts import report

    results = [json.loads((arguments.out / f"{job['number']}.json").read_text()) for job in jobs]
    report(results, arguments.out)


if __name__ == "__main__":
    main()
