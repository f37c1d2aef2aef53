"""python experiments/predictions [--data FOLDER] [--sets N] [--only NAME]: how well a fitted model answers.

Prints how exactly states come back from their loads and how fast, and how many of the measurements that no fit saw lie
within the 95 % bands: on the simulated bed, on data with a hidden effect (by the benchmark's own code) with and without
the effect in the model, and on measured data, which lie in FOLDER (docs/real_data.md).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(Path(__file__).parent), str(ROOT), str(ROOT / "experiments"), str(ROOT / "experiments/real_data")]

import torch  # noqa: E402
from commanded import commanded_table, draw_commanded, end_block, muscle  # noqa: E402
from coverage import coverage_table, hidden_sets, real_sets, simulated_sets  # noqa: E402
from rich.console import Console  # noqa: E402
from round_trip import round_trip_table  # noqa: E402

PARTS = ["round_trip", "simulated", "hidden", "real", "commanded"]


def main() -> None:
    """Runs what was named, all by default."""
    parser = argparse.ArgumentParser(description="Answers of fitted models: exactness, speed, coverage.")
    parser.add_argument("--data", type=Path, help="where the measured data lie; without it they are left out")
    parser.add_argument("--sets", type=int, default=30, help="data sets with a hidden effect")
    parser.add_argument("--seeds", type=int, default=5, help="splits of each measured or simulated set")
    parser.add_argument("--only", choices=PARTS, action="append")
    parser.add_argument("--picture", type=Path, help="where the picture of what was commanded goes (PNG)")
    asked = parser.parse_args()
    console, wanted = Console(width=170), asked.only or PARTS
    torch.set_num_threads(2)
    if "round_trip" in wanted:
        console.print(round_trip_table())
    torch.set_num_threads(1)
    parts: dict[str, Callable] = {
        "simulated": lambda: simulated_sets(asked.seeds),
        "hidden": lambda: hidden_sets(asked.sets),
        "real": lambda: real_sets(asked.data, asked.seeds) if asked.data else [],
    }
    for name, sets in parts.items():
        if name in wanted:
            console.print(coverage_table(name, sets(), console))
    if "commanded" in wanted:
        pressures = [muscle(), *([end_block(asked.data)] if asked.data else [])]
        console.print(commanded_table(pressures))
        if asked.picture:
            draw_commanded(pressures, asked.picture)


if __name__ == "__main__":
    main()
