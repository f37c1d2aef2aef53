"""python experiments/real_data FOLDER [NAME …]: every measured data set from its raw file to a report, by two commands.

FOLDER holds the data that others measured (docs/real_data.md says which). Prints what each search ended with, and for
the muscle of the README how large its errors are, also at lengths left out, beside a polynomial.
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
sys.path[:0] = [str(Path(__file__).parent), str(ROOT)]

from muscle import muscle_table  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402
from sets import SETS, RealSet  # noqa: E402


def main() -> None:
    """Runs the sets that were named, all by default."""
    parser = argparse.ArgumentParser(description="Measured data sets, from raw file to report.")
    parser.add_argument("folder", type=Path, help="where the measured data lie")
    parser.add_argument("names", nargs="*", help=f"of {', '.join(s.recipe for s in SETS)}; all by default")
    parser.add_argument("--out", type=Path, help="where tables and reports go; a temporary folder by default")
    asked = parser.parse_args()
    out = (asked.out or Path(tempfile.mkdtemp())).resolve()
    console = Console(width=140)
    table = Table("data set", "verdict", "effects", "E %", "held-out σ", "seconds", title="Two commands each")
    for chosen in SETS:
        if not asked.names or chosen.recipe in asked.names:
            table.add_row(*_row(chosen, asked.folder.resolve(), out))
    console.print(table)
    if not asked.names or "dmsp_20_300" in asked.names:
        console.print(muscle_table(out / "dmsp_20_300.csv"))
    console.print(f"reports: {out}")


def _row(chosen: RealSet, data: Path, out: Path) -> list[str]:
    began = time.perf_counter()
    for command in chosen.commands(data, out):
        done = subprocess.run([sys.executable, *command], cwd=ROOT, capture_output=True, text=True)
        if done.returncode:
            return [chosen.recipe, "failed", (done.stderr or done.stdout).strip()[-200:], "", "", ""]
    found = json.loads((out / chosen.recipe / "discovery.json").read_text(encoding="utf-8"))
    before, after = (f"{100 * found['error'][name]:.3g}" for name in ("before", "after"))
    first, last = (found["trail"][i].get("sigmas_heldout") for i in (0, -1))
    sigmas = f"{first:.2g} → {last:.2g}" if first and last else ""
    names = " + ".join(" | ".join(members) for members in found["classes"]) or "–"
    return [chosen.recipe, found["verdict"], names, f"{before} → {after}", sigmas, f"{time.perf_counter() - began:.0f}"]


if __name__ == "__main__":
    main()
