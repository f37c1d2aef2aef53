"""Approximate Bayesian computation by sequential Monte Carlo: the beds whose figures come closest to the paper's.

Del Moral, Doucet & Jasra, Statistics and Computing 22 (2012) 1009. The prior is standard normal in all numbers, so that
the moves keep it without weights (preconditioned Crank-Nicolson: Cotter et al., Statistical Science 28 (2013) 424).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from summary import judged, thinned
from truth import COUNT, made

from freelearn.common.csv_text import csv_text
from freelearn.common.files import write_text

# Of the kinematic states, every so manyth: fits take less time, their errors change by a few percent.
EVERY = 8
# Share of the beds that stay in the next generation.
STAY = 0.5
# Step of the moves, and how it follows the share of them that are taken.
STEP, FEWEST, MOST = 0.7, 0.15, 0.4
MOVED = 0.3

Job = tuple[np.ndarray, int, bool, float]
Map = Callable[[Callable[[Job], Any], Iterable[Job]], Iterator[Any]]


@dataclass(frozen=True)
class Bed:
    """A bed of the current generation: its numbers in the prior, its figures and its distance.

    seed: of its noise and of what is kept of it. Moves leave it: else the nearest would be those lucky with it.
    """

    numbers: np.ndarray
    seed: int
    told: dict[str, float]
    distance: float


def tried(job: Job) -> Bed:
    """A bed simulated and judged; its distance is infinite where it is above the job's."""
    torch.set_num_threads(1)
    numbers, seed, whole, most = job
    told, far = judged(thinned(made(numbers, seed), EVERY, seed), whole, most)
    return Bed(numbers, seed, told, far)


def search(count: int, generations: int, seed: int, whole: bool, folder: Path, each: Map) -> Iterator[list[Bed]]:
    """The beds after each generation, nearest first; those in the folder are read. whole: as
    summary.judged. each: maps over several cores."""
    beds: list[Bed] = []
    step = STEP
    for generation in range(generations):
        path = folder / f"generation_{generation:02d}.csv"
        generator = np.random.default_rng([seed, generation])
        if path.exists():
            beds, step = _read(path)
        else:
            if generation == 0:
                jobs = [(generator.normal(size=COUNT), n, whole, math.inf) for n in range(count)]
                beds = list(each(tried, jobs))
            else:
                beds, step = _moved(beds, step, whole, generator, each)
            beds.sort(key=lambda bed: bed.distance)
            write_text(path, csv_text(_frame(beds, step), "%.10g"))
        yield beds


def _moved(
    beds: list[Bed], step: float, whole: bool, generator: np.random.Generator, each: Map
) -> tuple[list[Bed], float]:
    """The nearer half, doubled, each moved once under the distance that the half leaves."""
    half = beds[: math.ceil(STAY * len(beds))]
    most = half[-1].distance
    drawn = [half[n] for n in generator.integers(len(half), size=len(beds) - len(half))]
    before = half + drawn
    jobs = []
    for bed in before:
        moved = math.sqrt(1 - step**2) * bed.numbers + step * generator.normal(size=COUNT)
        # Some of the numbers at a time: all at once are hardly ever all for the better.
        numbers = np.where(generator.random(COUNT) < MOVED, moved, bed.numbers)
        jobs.append((numbers, bed.seed, whole, most))
    after = list(each(tried, jobs))
    taken = np.mean([bed.distance <= most for bed in after])
    step *= 0.7 if taken < FEWEST else 1.3 if taken > MOST else 1.0
    return [new if new.distance <= most else old for old, new in zip(before, after, strict=True)], min(step, 0.95)


def _frame(beds: list[Bed], step: float) -> pd.DataFrame:
    numbers = pd.DataFrame([bed.numbers for bed in beds]).add_prefix("u")
    return pd.concat(
        [
            pd.DataFrame({"distance": [b.distance for b in beds], "step": step, "seed": [b.seed for b in beds]}),
            numbers,
            pd.DataFrame([b.told for b in beds]),
        ],
        axis=1,
    )


def _read(path: Path) -> tuple[list[Bed], float]:
    table = pd.read_csv(path)
    numbers = table[[f"u{n}" for n in range(COUNT)]].to_numpy()
    names = table.columns[3 + COUNT :]
    told = [{name: row[name] for name in names if np.isfinite(row[name])} for _, row in table.iterrows()]
    distances = table["distance"].fillna(math.inf)
    return [Bed(*each) for each in zip(numbers, table["seed"].tolist(), told, distances, strict=True)], float(
        table["step"].iloc[0]
    )
