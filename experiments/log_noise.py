"""python experiments/log_noise.py: do intervals hold where a log's noise has a memory, and is that memory found?

Logs of the bed apart (freelearn/testing/reference/simulated_logs.py) with creep hidden, whose noise goes on from row to
row by several correlations. Of each the model with creep is fitted as the search fits it, and its 95 % intervals (C1,
C2, share and time of creep) are held against what is hidden. Prints by correlation: how many hold, how many would if
the noise were taken for white, and the memory that was found beside the true one.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from rich.progress import track

MEMORIES = (0.0, 0.5, 0.8, 0.95)
# Rows a second of the logs.
RATE = 5.0
# What each kind of log draws.
SAMPLES = (3, 4, 5)


def examined(job: tuple[float, int]) -> dict[str, Any]:
    """Which intervals hold, with the memory that was found and as if there were none; and that memory."""
    # Imported by the workers alone: torch takes a while.
    from dataclasses import replace

    import torch

    from freelearn.data.accuracy import PAPER
    from freelearn.data.rows import Rows
    from freelearn.discovery.fits.prepare import Question, prepare
    from freelearn.discovery.fits.step import parameter_covariance
    from freelearn.discovery.fits.white_fit import white_fit
    from freelearn.discovery.noise.noise import Whitener
    from freelearn.fitting.uncertainty import interval
    from freelearn.physics.models.build import build_model
    from freelearn.testing.reference.simulated_logs import C1, C2, UNIT, log

    torch.set_num_threads(1)
    memory, seed = job
    rows = Rows.from_table(log({"creep": UNIT["creep"]}, seed, (SAMPLES[seed % 3],), rate=RATE, memory=memory))

    def build(names: Any) -> Any:
        return build_model("continuum", {}, list(names))

    question = Question(build, [], rows, PAPER, seed, given=["creep"])
    prepared, fit, noise = prepare(question)
    truth = {"C1": C1, "C2": C2} | {f"creep.{label}": value for label, value in UNIT["creep"].items()}

    def holds(whiten: Whitener) -> list[bool]:
        step = prepared.step(white_fit(fit.model, prepared.rows, whiten, fit.vector, fit.prior), whiten)
        values = step.fit.values()
        errors = torch.diagonal(parameter_covariance(step)).sqrt().numpy()
        log_scale = [step.fit.model.declared[label].log for label in values]
        low, high = interval(
            list(values.values()), errors, log_scale, max(prepared.rows.state.max() + 1 - len(values), 1)
        )
        return [bool(a <= truth[label] <= b) for label, a, b in zip(values, low, high, strict=True)]

    found = noise.scatter.memory
    white = replace(noise, scatter=replace(noise.scatter, memory=None))
    share, time = (found.share.tolist(), found.time.tolist()) if found else ([0.0, 0.0], [np.nan, np.nan])
    return {"holds": holds(noise.whitener()), "as white": holds(white.whitener()), "share": share, "time": time}


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seeds", type=int, default=40, help="logs of each kind")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    jobs = [(memory, seed) for memory in MEMORIES for seed in range(asked.seeds)]
    with ProcessPoolExecutor(asked.workers) as pool:
        found = list(track(pool.map(examined, jobs), "logs", len(jobs)))
    print(f"{'correlation':>12}{'intervals hold':>16}{'if white':>10}{'share':>14}{'time [s]':>16}{'true':>8}")
    for memory in MEMORIES:
        own = [f for job, f in zip(jobs, found, strict=True) if job[0] == memory]
        held, white = (np.mean([f[name] for f in own]) for name in ("holds", "as white"))
        share = np.median([f["share"] for f in own], axis=0)
        time = np.nanmedian([f["time"] for f in own], axis=0) if share.any() else np.full(2, np.nan)
        true = -1 / RATE / np.log(memory) if memory else np.nan
        both = f"{share[0]:.2f} {share[1]:.2f}", f"{time[0]:.2f} {time[1]:.2f}"
        print(f"{memory:>12g}{held:>16.1%}{white:>10.1%}{both[0]:>14}{both[1]:>16}{true:>8.2f}")


if __name__ == "__main__":
    main()
