"""python experiments/real_data FOLDER [NAME …]: every measured data set from its raw file to a report, by two commands.

FOLDER holds the data that others measured (docs/real_data.md says which). Prints what each search ended with, then how
large the errors of several models are, also on parts that were left out whole, beside a polynomial and what was
published.
The pictures of docs/real_data.md come from experiments/pictures.py.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(Path(__file__).parent), str(ROOT / "experiments"), str(ROOT)]

from arteries import arteries_table  # noqa: E402
from free_end import free_end_table  # noqa: E402
from held_pose import LOG, held_pose_table  # noqa: E402
from hung_torque import hung_torque_table  # noqa: E402
from left_out import left_out_table  # noqa: E402
from questions import QUESTIONS  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402
from sets import SETS, RealSet  # noqa: E402


def main() -> None:
    """Runs the sets that were named, all by default."""
    parser = argparse.ArgumentParser(description="Measured data sets, from raw file to report.")
    parser.add_argument("folder", type=Path, help="where the measured data lie")
    parser.add_argument("names", nargs="*", help=f"of {', '.join(s.recipe for s in SETS)}; all by default")
    parser.add_argument("--out", type=Path, help="where tables and reports go; a temporary folder by default")
    parser.add_argument("--no-search", action="store_true", help="only intake and the tables of errors")
    parser.add_argument("--only-search", action="store_true", help="no tables of errors")
    asked = parser.parse_intermixed_args()
    if unknown := set(asked.names) - {each.recipe for each in SETS}:
        parser.error(f"no data set {', '.join(sorted(unknown))}: choose from {', '.join(s.recipe for s in SETS)}")
    out = (asked.out or Path(tempfile.mkdtemp())).resolve()
    console = Console(width=200)
    chosen = [each for each in SETS if not asked.names or each.recipe in asked.names]
    table = Table(
        "data set",
        "verdict",
        "effects",
        "E %",
        "misfit in noise standard deviations",
        "seconds",
        title="Two commands each",
    )
    for each in chosen:
        row = _row(each, asked.folder.resolve(), out, not asked.no_search)
        table.add_row(*row)
        console.print(*row, sep=" · ")
    console.print(table)
    for each in [] if asked.only_search else chosen:
        for question in QUESTIONS:
            if question.recipe == each.recipe:
                console.print(left_out_table(question, each, out))
        if each.recipe == "vessels":
            console.print(arteries_table(each, out))
        if each.recipe == "parallel_free_end":
            console.print(free_end_table(each, out))
            if (asked.folder / LOG).exists():
                console.print(held_pose_table(asked.folder))
        if each.recipe == "torsion_4angles":
            console.print(hung_torque_table(each, out))
    console.print(f"reports: {out}")


def _row(chosen: RealSet, data: Path, out: Path, searched: bool) -> list[str]:
    began = time.perf_counter()
    for command in chosen.commands(data, out)[: 2 if searched else 1]:
        done = subprocess.run([sys.executable, *command], cwd=ROOT, capture_output=True, text=True)
        if done.returncode:
            return [chosen.recipe, "failed", (done.stderr or done.stdout).strip()[-200:], "", "", ""]
    if not searched:
        return [chosen.recipe, "not searched", "", "", "", ""]
    found = json.loads((out / chosen.recipe / "discovery.json").read_text(encoding="utf-8"))
    before, after = (f"{100 * found['error'][name]:.3g}" for name in ("before", "after"))
    first, last = (found["trail"][i].get("sigmas_heldout") for i in (0, -1))
    sigmas = f"{first:.2g} → {last:.2g}" if first and last else ""
    names = " + ".join(" | ".join(members) for members in found["classes"]) or "–"
    return [chosen.recipe, found["verdict"], names, f"{before} → {after}", sigmas, f"{time.perf_counter() - began:.0f}"]


if __name__ == "__main__":
    main()
