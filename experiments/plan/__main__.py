"""python experiments/plan: how many rows split a class of two effects, planned and by a grid.

Data are made by a bed apart from the package, hidden effects in the literature's forms: a first look at two actuators,
few and gentle states, which ends in a class of two effects that holds the true one. Then rows are measured as `plan`
says, as many at a time as are expected to do, until one member is ahead by 9 in χ² after refitting both; and as a grid
over the bed's reach has them, in order and at random. Prints what came out and writes it to outputs/plan_experiment,
where what was done before is not done again.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from freelearn.common.files import write_text

OUT = Path("outputs/plan_experiment")
# First looks at most for each class that is wanted.
TRIES = 12


def examine(job: tuple[int, bool]) -> dict:
    """As closed_loop.examine: imported by the workers alone, because torch takes a while."""
    from closed_loop import examine

    return examine(*job)


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(prog="python experiments/plan", description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=100, help="classes of two that can be told within reach")
    parser.add_argument(
        "--searched", type=int, default=10, help="classes after which the whole library is searched again"
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=OUT)
    arguments = parser.parse_args()
    out = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    numbers = range(TRIES * arguments.count)
    results: list[dict] = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for start in range(0, len(numbers), arguments.workers):
            results += _some(list(numbers[start : start + arguments.workers]), arguments.searched, out, pool)
            told = sum(result["usable"] for result in results)
            print(f"\r{len(results)} first looks, {told} classes of two", end="", flush=True)
            if told >= arguments.count:
                break
    print()
    from loop_report import report

    print(report(results))


def _some(numbers: list[int], searched: int, out: Path, pool: ProcessPoolExecutor) -> list[dict]:
    """The results of some first looks, kept ones read."""
    todo = [number for number in numbers if not (out / f"{number}.json").exists()]
    # About one first look in six gives a class: whole searches are spread over the first of them.
    for result in pool.map(examine, [(number, number < 6 * searched) for number in todo]):
        write_text(out / f"{result['number']}.json", json.dumps(result) + "\n")
    return [json.loads((out / f"{number}.json").read_text()) for number in numbers]


if __name__ == "__main__":
    main()
