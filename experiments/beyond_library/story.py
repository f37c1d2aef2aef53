"""python experiments/beyond_library/story.py: a table with physics that no library has, from the independent bed.

Two actuators with a slack cable beside them, which pulls beyond 2 mm of elongation; noise with heavy tails, and one row
in a hundred with a wrong reading. Writes outputs/beyond/cable.csv and says how to search it, or searches it.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np

from freelearn.testing.reference import truths
from freelearn.testing.reference.laboratory import Laboratory, measure, random_actuators

ROOT = Path(__file__).resolve().parents[2]
ACCURACY = {"elongation_mm": 0.073, "twist_deg": 0.175, "pressure_kpa": 0.15, "force_n": 0.03, "moment_nmm": 0.6}
SEED, MATERIAL = 3, (1e6, 3e7)
# Times 50 N/m.
STIFFNESS = 10.0


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(prog="python experiments/beyond_library/story.py")
    parser.add_argument("--out", type=Path, default=Path("outputs/beyond"), help="where the table goes")
    parser.add_argument("--search", action="store_true", help="search it as well")
    asked = parser.parse_args()
    laboratory = Laboratory(slipped=0.01, tails=4.0)
    actuators = random_actuators(2, np.random.default_rng(SEED))
    hidden = truths.outside("slack_cable", STIFFNESS)
    table = measure(laboratory, actuators, *MATERIAL, {}, ACCURACY, SEED, hidden).table
    path = asked.out / "cable.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False)
    told = [f"data.accuracy.{name}={value}" for name, value in ACCURACY.items()]
    words = ["discover.py", "data=csv", f"data.path={path}", *told, f"hydra.run.dir={asked.out / 'search'}"]
    print(f"{path}: {len(table)} rows. Now:\npython {shlex.join(words)}", flush=True)
    if asked.search:
        sys.exit(subprocess.run([sys.executable, *words], cwd=ROOT, check=False).returncode)


if __name__ == "__main__":
    main()
