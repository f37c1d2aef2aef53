"""python experiments/beyond_library: how well the search writes effects that no library has.

Hides physics of 36 kinds, none of which is an effect of the library or a sum of two, in data made by code that shares
nothing with the search, and judges what it proposes: the error on fresh states within the box and beyond it, and
whether place, inputs and form are right. --half open: 18 kinds that whoever writes the search may look at; sealed: the
18 others, for one look at the end. Control sets hide nothing, or one effect of the library.

--pairs hides two at once.

Each round (--seeds) has every kind at every size and 50 control sets; the full plan has 4 rounds. Writes a line of
results.jsonl in --out for each data set; with --resume those that are there are kept.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from beyond_library.plan import HALVES, ROUNDS, SIZES, pairs, plan
from hidden_effects.plan import some
from rich.progress import track


def judged(job: dict) -> dict:
    """As judge.judged: imported by the workers alone, because torch takes a while."""
    from beyond_library.judge import judged

    return judged(job)


def stored(path: Path) -> dict[str, dict]:
    """Results by key; a line that an interruption cut short is none."""
    found = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            result = json.loads(line)
        except ValueError:
            continue
        found[result["key"]] = result
    return found


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(prog="python experiments/beyond_library", description=__doc__.split("\n")[0])
    parser.add_argument("--half", choices=HALVES, default="open")
    parser.add_argument("--seeds", type=int, default=1, help=f"rounds of the plan; {ROUNDS} are the full one")
    parser.add_argument("--pairs", action="store_true", help="two at once: kinds, or a kind and an effect")
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)), help="σ after refitting C1 and C2: 8,15,30")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--some", type=int, help="stop after this many data sets, spread over the plan")
    parser.add_argument("--only", default="", help="data sets alone whose key holds this: a kind's name, 'nothing'")
    parser.add_argument("--out", type=Path, help="default: outputs/beyond_library/HALF")
    parser.add_argument("--resume", action="store_true", help="keep the data sets that are done")
    arguments = parser.parse_args()
    planned = pairs if arguments.pairs else plan
    out = arguments.out or Path("outputs/beyond_library") / (arguments.half + "_pairs" * arguments.pairs)
    sizes = [int(size) for size in arguments.sizes.split(",")]
    jobs = [job for job in planned(arguments.half, arguments.seeds, sizes) if arguments.only in job["key"]]
    jobs = some(jobs, arguments.some)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "results.jsonl"
    if not arguments.resume:
        path.unlink(missing_ok=True)
    done = stored(path)
    todo = [job for job in jobs if job["key"] not in done]
    with ProcessPoolExecutor(arguments.jobs) as pool, path.open("a") as file:
        if todo and path.stat().st_size and not path.read_text().endswith("\n"):
            file.write("\n")
        futures = [pool.submit(judged, job) for job in todo]
        for future in track(as_completed(futures), total=len(futures), description="data sets"):
            result = future.result()
            done[result["key"]] = result
            file.write(json.dumps(result, allow_nan=False) + "\n")
            file.flush()
    from beyond_library.report import report, report_pairs

    results = [done[job["key"]] for job in jobs]
    if arguments.pairs:
        report_pairs(results)
    else:
        report(results, arguments.half)
    print(f"files: {out}")


if __name__ == "__main__":
    main()
