"""python experiments/plan/story.py NUMBER FOLDER: one class split by the commands that a user gives.

Writes the table of a first look (see first_look.py), searches it, plans the rows that split its class, measures them by
the same bed, and searches again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(Path(__file__).parent), str(ROOT), str(ROOT / "experiments")]

import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
from first_look import REACH, first_look  # noqa: E402

from freelearn.common.csv_text import csv_text  # noqa: E402


def main() -> None:
    """Runs the story."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[2])
    parser.add_argument("number", type=int, help="of the first look")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rows", type=int, default=4)
    asked = parser.parse_args()
    folder = asked.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    truth, table, effect = first_look(asked.number)
    print(f"hidden: {effect}")
    _searched(table, folder, "first")
    # The bed can do more than the first look dared.
    reach = ",".join(f"{name}:[{low:g},{high:g}]" for name, (low, high) in REACH.items())
    words = [f"run={folder / 'first'}", f"rows={asked.rows}", "reach={" + reach + "}"]
    _run("plan.py", *words, f"hydra.run.dir={folder / 'plan'}")
    planned = pd.read_csv(folder / "plan" / "plan.csv")
    longer = truth.measured(table, planned, np.random.default_rng(asked.number + 1))
    _searched(longer, folder, "second")


def _searched(table: pd.DataFrame, folder: Path, name: str) -> None:
    path = folder / f"{name}.csv"
    path.write_text(csv_text(table.drop(columns=[c for c in table if table[c].isna().all()])), encoding="utf-8")
    _run("discover.py", "train=all", "data=csv", f"data.path={path}", f"hydra.run.dir={folder / name}")
    found = json.loads((folder / name / "discovery.json").read_text(encoding="utf-8"))
    print(f"{name}: {len(table)} rows, {found['says']}")


def _run(program: str, *words: str) -> None:
    done = subprocess.run([sys.executable, str(ROOT / program), *words], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stdout + done.stderr)
    if program == "plan.py":
        print(done.stdout)


if __name__ == "__main__":
    main()
