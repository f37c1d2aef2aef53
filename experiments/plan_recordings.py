"""python experiments/plan_recordings.py: does the recording that `plan` proposes split two effects of the history?

A bed apart from the package (small steps of integration) makes a first look of three recordings, slow ways up and down
at three places, in which one effect is hidden that another may stand in for. Where both explain it alike one recording
more is made: the planned one, one of ramps and holds at random in which length and twist move too, and one like the
first. Prints by how much χ² the truth is then ahead, and how much was expected.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import permutations

import numpy as np
import pandas as pd

SAMPLE, RATE, SECONDS, RECORDINGS = 4, 5.0, 8.0, 3
# As large as a slow first look shows by some σ.
HIDDEN: dict[str, dict[str, float]] = {
    "creep": {"share": 0.05, "time": 1.0},
    "maxwell_slip": {"share": 0.1, "force": 2.0, "moment": 0.01, "asymmetry": 0.0},
    "contact_slip": {"share": 0.1, "force": 0.01, "moment": 0.01},
    "supply_lag": {"time": 0.03},
    "sensor_lag": {"force": 0.03, "moment": 0.03},
    "dead_time": {"delay": 0.03},
}
# χ² by which one is ahead once two are split, and by which two explain a first look alike.
SPLIT, ALIKE = 9.0, 4.0
WAYS = ("planned", "at random", "like the first")
# Levels that ways up and down go to, and how fast the bed can go.
TOPS = (40.0, 70.0, 60.0, 70.0)
REACH = {"pressure_kpa": (0.0, 70.0), "elongation_mm": (-4.0, 4.0), "twist_deg": (-90.0, 90.0)}
FASTEST = {"pressure_kpa_per_s": (0.0, 175.0), "elongation_mm_per_s": (0.0, 4.0), "twist_deg_per_s": (0.0, 90.0)}


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(prog="python experiments/plan_recordings.py", description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    jobs = [(*pair, seed) for seed in range(arguments.seeds) for pair in permutations(HIDDEN, 2)]
    with ProcessPoolExecutor(arguments.workers) as pool:
        found = [result for result in pool.map(_examined, jobs) if result]
    told = [result for result in found if result["expected"] >= SPLIT]
    print(f"{len(jobs)} first looks; two effects explain {len(found)} alike; a recording tells {len(told)} of these")
    print("\n".join(_lines(pd.DataFrame(told))))


def _lines(found: pd.DataFrame) -> Iterator[str]:
    yield "| one recording more | split | for the true effect | χ² ahead, median |"
    yield "|---|---|---|---|"
    for way in WAYS:
        ahead = found[way]
        right = ahead[ahead.abs() >= SPLIT] > 0
        told = f"{100 * right.mean():.0f} %" if len(right) else "–"
        yield f"| {way} | {100 * (ahead.abs() >= SPLIT).mean():.0f} % | {told} | {ahead.median():.1f} |"
    size = np.sqrt(found["planned"].clip(lower=0) / found["expected"]).median()
    yield f"√χ² realized over expected, median: {size:.2f}; seconds a plan: {found['seconds'].median():.1f}"


def _examined(job: tuple[str, str, int]) -> dict[str, float | str] | None:
    import time

    import torch

    from freelearn.data.accuracy import PAPER
    from freelearn.data.rows import Rows
    from freelearn.discovery.fits.white_fit import WhiteFit
    from freelearn.fitting.starts import starts
    from freelearn.physics.models.build import build_model
    from freelearn.queries.next_measurements.exact_plan import choose
    from freelearn.queries.next_measurements.goals import Discriminate, score
    from freelearn.queries.next_measurements.known_rows import Known
    from freelearn.queries.next_measurements.recordings import in_order, recordings, usual_rows
    from freelearn.testing.reference.simulated_logs import log, measured

    torch.set_num_threads(1)
    true, rival, seed = job
    hidden = {true: HIDDEN[true]}
    drawn = log({}, seed, (SAMPLE,), RECORDINGS + 1, RATE, SECONDS, noise=0.0)
    place = drawn.groupby("run")[["elongation_mm", "twist_deg"]].transform("first")
    up = drawn.groupby("run")["time_s"].transform(lambda time: 1 - np.abs(time / (SECONDS / 2) - 1))
    slow = drawn.assign(**place, pressure_kpa=up * drawn["run"].map(dict(enumerate(TOPS, start=1))))
    every = measured(slow, hidden, seed)
    first, like = every[every["run"] <= RECORDINGS], every[every["run"] > RECORDINGS]

    def fits(table: pd.DataFrame, begin: dict[str, torch.Tensor] | None = None) -> tuple[Known, dict[str, WhiteFit]]:
        rows = Rows.from_table(table)
        models = {name: build_model("continuum", {}, [name], [SAMPLE]) for name in (true, rival)}
        at = begin or {
            name: starts(model, rows, 1, torch.Generator().manual_seed(0))[0] for name, model in models.items()
        }
        known = Known.from_rows(table, rows, models[true], at[true], PAPER)
        return known, {true: known.fit, rival: known.fitted(models[rival], at[rival])}

    known, members = fits(first)
    if not all(fit.proper for fit in members.values()) or abs(members[rival].chi2 - members[true].chi2) > ALIKE:
        return None
    began = time.perf_counter()
    goal = Discriminate.from_fits([members])
    there = recordings(known, goal, usual_rows(first), REACH | FASTEST)
    table = in_order(there, choose(there.objective, 1, 1, 0.0, seed).visits, first, seed)
    expected = next(gain.gain for gain in score(known, goal, table).gains if gain.name[0] == true)
    seconds = time.perf_counter() - began
    result: dict[str, float | str] = {"true": true, "rival": rival, "expected": expected, "seconds": seconds}
    brisk = drawn[drawn["run"] > RECORDINGS]
    more = {
        "planned": measured(table, hidden, 1000 + seed),
        "at random": measured(brisk, hidden, 1000 + seed),
        "like the first": like,
    }
    for way, recording in more.items():
        joined = pd.concat([first, recording], ignore_index=True)
        _, after = fits(joined, {name: fit.vector for name, fit in members.items()})
        result[way] = after[rival].chi2 - after[true].chi2 - (members[rival].chi2 - members[true].chi2)
    return result


if __name__ == "__main__":
    main()
