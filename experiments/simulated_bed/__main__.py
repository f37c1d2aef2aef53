"""python experiments/simulated_bed: which simulated samples show the figures that the paper reports of its real ones.

Draws beds from a prior over materials, imperfections and how samples differ, fits the paper's three models on each in
all 100 pairings, and keeps those that come closest (search.py). The nearest ones are then judged anew with all their
states and other noise. Prints the figures beside the published ones and what the beds are made of. Each
generation is kept in outputs/simulated_bed and not made again.
"""

from __future__ import annotations

import argparse
import math
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table
from search import Bed, search
from summary import TARGETS, WITHIN, distance, judged
from truth import DATA, SIZES, made, sizes

from freelearn.api.tasks.loaded_table import load_table

OUT = Path("outputs/simulated_bed")


def again(job: tuple[np.ndarray, int, bool]) -> dict[str, float]:
    """A bed's figures with all of its states, and other noise than the search had."""
    numbers, seed, whole = job
    return judged(made(numbers, seed), whole)[0]


def as_it_is(whole: bool) -> dict[str, float]:
    """The figures of data=virtual."""
    return judged(load_table(DATA).table, whole)[0]


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(prog="python experiments/simulated_bed", description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=64, help="beds in a generation")
    parser.add_argument("--generations", type=int, default=14)
    parser.add_argument("--nearest", type=int, default=4, help="beds that are judged anew")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=OUT)
    largest = "errors in units of the largest loads of the test set, or of all samples; the paper leaves it open"
    parser.add_argument("--largest", choices=("set", "all"), default="all", help=f"{largest} (default: all)")
    arguments = parser.parse_args()
    whole = arguments.largest == "all"
    out = arguments.out / arguments.largest
    out.mkdir(parents=True, exist_ok=True)
    beds: list[Bed] = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        steps = search(arguments.count, arguments.generations, arguments.seed, whole, out, pool.map)
        for number, beds in enumerate(steps, 1):
            middle = beds[len(beds) // 2].distance
            print(
                f"generation {number}: nearest {beds[0].distance:.3f}, median {middle:.3f}", file=sys.stderr, flush=True
            )
        jobs = [(bed.numbers, 10_000 + n, whole) for n, bed in enumerate(beds[: arguments.nearest])]
        checked = [pool.submit(as_it_is, whole).result(), *pool.map(again, jobs)]
    console = Console(width=120)
    console.print(_figures(checked, beds))
    console.print(_made_of(beds))


def _figures(checked: list[dict[str, float]], beds: list[Bed]) -> Table:
    every = pd.DataFrame([bed.told for bed in beds])
    shown = Table(title="the paper's figures on its own samples, and on simulated ones (E in %, constants in Pa)")
    headings = ("", "paper", "data=virtual", *(f"bed {n}" for n in range(1, len(checked))), "last generation")
    for heading in headings:
        shown.add_column(heading, justify="right")
    for name, target in TARGETS.items():
        cells = [_beside(told[name], target) if told else "—" for told in checked]
        low, high = every[name].quantile([0.05, 0.95])
        shown.add_row(name, f"{target:.3g}", *cells, f"{low:.3g} … {high:.3g}")
    met = [str(sum(_near(told[n], t) for n, t in TARGETS.items())) if told else "—" for told in checked]
    shown.add_row(f"within {WITHIN:g}", f"of {len(TARGETS)}", *met, "")
    far = [f"{math.exp(distance(told)):.2g}" if told else "—" for told in checked]
    every_far = np.exp([bed.distance for bed in beds])
    low, high = np.quantile(every_far, [0.05, 0.95])
    shown.add_row("typical factor, without C2", "", *far, f"{low:.2g} … {high:.2g}")
    return shown


def _near(value: float, target: float) -> bool:
    return bool(1 / WITHIN <= value / target <= WITHIN)


def _beside(value: float, target: float) -> str:
    return f"{value:.3g}" if _near(value, target) else f"[red]{value:.3g}[/red] ×"


def _made_of(beds: list[Bed]) -> Table:
    every = pd.DataFrame([sizes(bed.numbers) for bed in beds])
    shown = Table(title="what the beds are made of (SI): 5, 50 and 95 % of the last generation, and of the prior")
    for heading in ("", "5 %", "median", "95 %", "prior"):
        shown.add_column(heading, justify="right")
    for name, size in SIZES.items():
        quantiles = [f"{q:.3g}" for q in every[name].quantile([0.05, 0.5, 0.95])]
        shown.add_row(name, *quantiles, f"{size.at(0.05):.3g} … {size.at(0.95):.3g}")
    return shown


if __name__ == "__main__":
    main()
