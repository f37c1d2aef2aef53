"""python experiments/referee_rates.py: does the rate of wrong names that `referee=simulate` tells hold?

For each of five designs with nothing hidden (tables of few states, made by the reference physics): what simulated
tables say, half of it what a run would be told; and what searches name on as many tables that the reference makes of
the same design with fresh noise. Prints both with the limits that are told. Tables already done are not done again.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

from hidden_effects.few import make, plan
from rich.console import Console
from rich.progress import track
from rich.table import Table

from freelearn.common.files import write_text

DESIGNS = 5
OUT = Path("outputs/referee_rates")


def job_of(design: int) -> dict[str, Any]:
    """A design of the plan `few` with nothing hidden, its accuracy stated rightly: muscles and hung tubes in turn."""
    jobs = [job for job in plan(24 * 3 * DESIGNS, seed=2031) if job["kind"] == "none" and job["states"] > 2]
    return jobs[design] | {"misstated": 1.0}


def searched_table(design: int, kind: str, number: int) -> dict[str, Any]:
    """What a search says of one table: of the reference with fresh noise, or simulated from the fit to another one."""
    # Imported by the workers alone: torch takes a while.
    import torch
    from hidden_effects.examine_few import as_read, build, told

    from freelearn.data.columns import usable_rows
    from freelearn.data.rows import Rows
    from freelearn.discovery.fits.prepare import prepare
    from freelearn.discovery.search.search import search
    from freelearn.discovery.search.simulated_searches import searched
    from freelearn.discovery.search.testable import question_of_rows

    torch.set_num_threads(1)
    draw = number if kind == "reference" else 0
    made = make(job_of(design) | {"draw": 1_000 + draw})
    table = as_read(made.table, made.bed)
    seen = table[usable_rows(table)].reset_index(drop=True)
    rows = Rows.from_table(seen)
    asked = question_of_rows(build, seen.columns, rows, told(made.told), number)
    if kind == "reference":
        found = search(asked)
        return {"verdict": found.verdict, "effects": found.effects}
    _, fit, noise = prepare(asked)
    simulated = searched(asked, fit, noise.whitener(), [], number)
    return {"verdict": simulated.verdict, "effects": simulated.effects}


def claims(answer: dict[str, Any]) -> bool:
    """Whether something is named, where nothing is hidden."""
    return answer["verdict"] in ("named", "class", "proposed")


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--tables", type=int, default=40, help="of each kind and design")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=OUT)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    # Round by round, so that what is done when it is interrupted is spread over all designs.
    every = [(d, kind, n) for n in range(asked.tables) for d in range(DESIGNS) for kind in ("reference", "simulated")]
    path = {job: asked.out / "{}_{}_{}.json".format(*job) for job in every}
    todo = [job for job in every if not path[job].exists()]
    with ProcessPoolExecutor(asked.workers) as pool:
        futures = {pool.submit(searched_table, *job): job for job in todo}
        for future in track(as_completed(futures), total=len(todo), description="tables"):
            write_text(path[futures[future]], json.dumps(future.result()) + "\n")
    Console(width=120).print(rates(path))


def rates(path: dict[tuple[int, str, int], Path]) -> Table:
    """Wrong names of each design: told by simulated tables, found on the reference's."""
    from freelearn.discovery.search.simulated_searches import rate

    shown = Table("design", "told: wrong of", "95 % limits", "found: wrong of", "within", title="Names where none is")
    whole = {"simulated": [0, 0], "reference": [0, 0]}
    for design in [*range(DESIGNS), None]:
        counts = {}
        for kind in whole:
            answers = [claims(json.loads(p.read_text())) for (d, k, _), p in path.items() if (d, k) == (design, kind)]
            counts[kind] = whole[kind] if design is None else [sum(answers), len(answers)]
            if design is not None:
                whole[kind] = [a + b for a, b in zip(whole[kind], counts[kind], strict=True)]
        limits, found = rate(*counts["simulated"]), counts["reference"]
        within = limits["low"] <= found[0] / max(found[1], 1) <= limits["high"]
        name = "all" if design is None else f"{job_of(design)['tubes']}, {job_of(design)['states']} states"
        told = "{} of {}".format(*counts["simulated"])
        percent = f"{100 * limits['low']:.1f}–{100 * limits['high']:.1f} %"
        shown.add_row(name, told, percent, "{} of {}".format(*found), "yes" if within else "no")
    return shown


if __name__ == "__main__":
    main()
