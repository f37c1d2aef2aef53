"""python experiments/hidden_effects: how well hidden effects are found, on data of a bed apart from the package.

--plan clean: the paper's actuators and protocol, normal noise of the stated size. --plan laboratory: random actuators,
measured as laboratories measure, with heavy tails, slipped readings, noise that grows with the load, misstated accuracy
and short protocols; its effects have the literature's forms, not the package's formulas. --plan braids: what braided
muscles taught, hidden in helices and in braids, on the kinematic and the isometric bed, in the literature's forms.
--plan moves: measured as by `laboratory`, actuators that lean and walls that lag behind, alone, and beside and against
what they may be taken for. --plan wrong: tables that were mapped wrongly, of which the fault has to be said and nothing
claimed. --plan regular: even steps at even places, by gauges of three grades, and places visited three times. --plan
scattered: every row a place of its own, or places as coarse encoders read them. --plan blocks: several actuators side
by side on one load cell. --plan sessions: samples that differ in
their rubber, their fibers or their sensors, or a zero that wanders. --plan few: tables of few states, judged by states
between those that were measured. --plan time: logs with effects of the history, integrated by small steps; held and
hung: on beds that hold and that hang. --plan unknown: random smooth functions of place and pressure added to what a
laboratory measures, of which no effect of the library may be claimed.

Prints, writes to outputs/hidden_effects, or hidden_ and the name of another plan, and plots recovery against size, the
confusion matrix, what slipped, false alarms, coverage of the 95 % intervals and time; of the plan few it writes tables,
of the plans time, held, hung, unknown, regular, scattered, blocks and sessions it only prints. Data sets already done
are not done again.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from hidden_effects.blocks import blocks, report_blocks
from hidden_effects.few import few
from hidden_effects.over_time import held, hung, over_time, report_time
from hidden_effects.plan import PLANS, some
from hidden_effects.regular import regular
from hidden_effects.scattered import report_scattered, scattered
from hidden_effects.sessions import sessions
from hidden_effects.wrong import wrong
from rich.progress import track

from freelearn.common.files import write_text

OUT = {
    "clean": Path("outputs/hidden_effects"),
    "laboratory": Path("outputs/hidden_laboratory"),
    "braids": Path("outputs/hidden_braids"),
    "moves": Path("outputs/hidden_moves"),
    "wrong": Path("outputs/hidden_wrong"),
    "few": Path("outputs/hidden_few"),
    "time": Path("outputs/hidden_time"),
    "held": Path("outputs/hidden_held"),
    "hung": Path("outputs/hidden_hung"),
    "unknown": Path("outputs/hidden_unknown"),
    "directions": Path("outputs/hidden_directions"),
    "regular": Path("outputs/hidden_regular"),
    "scattered": Path("outputs/hidden_scattered"),
    "sessions": Path("outputs/hidden_sessions"),
    "blocks": Path("outputs/hidden_blocks"),
}


def examine(job: dict) -> dict:
    """As examine.examine: imported by the workers alone, because torch takes a while."""
    if "fault" in job:
        from hidden_effects.wrong import examine_wrong

        return examine_wrong(job)
    if "regular" in job:
        from hidden_effects.examine_regular import examine_regular

        return examine_regular(job)
    if "differs" in job:
        from hidden_effects.examine_sessions import examine_sessions

        return examine_sessions(job)
    if "scattered" in job:
        from hidden_effects.scattered import examine_scattered

        return examine_scattered(job)
    if "block" in job:
        from hidden_effects.blocks import examine_block

        return examine_block(job)
    if "recordings" in job:
        from hidden_effects.over_time import examine_time

        return examine_time(job)
    if "states" in job:
        from hidden_effects.examine_few import examine_few

        return examine_few(job)
    from hidden_effects.examine import examine

    return examine(job)


def done(job: dict, out: Path) -> bool:
    """Whether the file of a data set holds the answer to just this entry of the plan."""
    path = out / f"{job['number']}.json"
    return path.exists() and job.items() <= json.loads(path.read_text()).items()


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(prog="python experiments/hidden_effects", description=__doc__.split("\n")[0])
    logs = {"time": over_time, "held": held, "hung": hung}
    plans = PLANS | {
        "wrong": wrong,
        "few": few,
        **logs,
        "regular": regular,
        "scattered": scattered,
        "sessions": sessions,
        "blocks": blocks,
    }
    parser.add_argument("--plan", choices=plans, default="clean")
    parser.add_argument(
        "--seeds",
        type=int,
        default=1,
        help="rounds of the plan: 139, 211, 90, 36, 24, 69, 60, 24, 67, 30, 28, 36, 72, 14 or 40 data sets each",
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--most", type=int, help="stop after this many data sets, spread over the plan")
    parser.add_argument("--only", default="", help="data sets of this kind alone: none, one, several, …")
    parser.add_argument("--out", type=Path, help="default: the plan's, in outputs")
    arguments = parser.parse_args()
    out = arguments.out or OUT[arguments.plan]
    every = plans[arguments.plan](arguments.seeds)
    kinds = sorted({job["kind"] for job in every})
    if arguments.only not in ("", *kinds):
        parser.error(
            f"--only {arguments.only}: the plan {arguments.plan} has no such kind; choose from {', '.join(kinds)}"
        )
    jobs = [job for job in every if arguments.only in ("", job["kind"])]
    jobs = some(jobs, arguments.most)
    out.mkdir(parents=True, exist_ok=True)
    todo = [job for job in jobs if not done(job, out)]
    with ProcessPoolExecutor(arguments.workers) as pool:
        # As they end, so that what is done is kept while another takes long.
        futures = [pool.submit(examine, job) for job in todo]
        for future in track(as_completed(futures), total=len(todo), description="data sets"):
            result = future.result()
            write_text(out / f"{result['number']}.json", json.dumps(result) + "\n")
    from hidden_effects.report import report, report_wrong

    results = [json.loads((out / f"{job['number']}.json").read_text()) for job in jobs]
    if arguments.plan == "wrong":
        report_wrong(results)
        return
    if arguments.plan == "regular":
        from hidden_effects.examine_regular import report_regular

        report_regular(results)
        return
    if arguments.plan == "scattered":
        report_scattered(results)
        return
    if arguments.plan == "blocks":
        report_blocks(results)
        return
    if arguments.plan == "sessions":
        from hidden_effects.examine_sessions import report_sessions

        report_sessions(results)
        return
    if arguments.plan in logs:
        report_time(results)
        return
    if arguments.plan == "few":
        from hidden_effects.report_few import report_few

        report_few(results, out)
        return
    beside = OUT["clean"].glob("*.json") if arguments.plan != "clean" else []
    report(results, arguments.plan, out, [json.loads(path.read_text()) for path in beside])


if __name__ == "__main__":
    main()
