"""python experiments/real_readings.py FOLDER: which readings slipped in real measurements, and whether that matters.

FOLDER holds free70_single/measurements.csv and parallel_3/plateaus_test9.csv, which others measured. Each is searched
for missing effects, once as it is and once without the suspected readings; the answer must be the same. Of the three
actuators in parallel only the rows that the table can hold are taken: those in which one of them is inflated while the
others stay at their lowest pressure. What these carry there is part of that sample's stiffness.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
# Column of the pressure → Γ [deg] and the sense of the winding of each actuator in parallel.
PARALLEL = {"P48_kPa": (48.0, 1), "Pm48_kPa": (48.0, -1), "Pm85_kPa": (85.0, -1)}
LENGTH_MM, INNER_MM, OUTER_MM = 100.0, 4.77, 6.35
# The lowest pressures that the bed held, within what its regulators let through.
LOWEST_KPA = 25.0


def parallel(raw: pd.DataFrame) -> pd.DataFrame:
    """The measurement table of the rows in which one actuator alone is inflated: a sample for each.

    A fiber wound the other way is the mirror image: twist and moment change their signs. The raw loads hold the
    sensor's offset, which is that of the first state at the lowest pressures, and their signs are the recorder's.
    """
    parts = []
    for number, (column, (gamma, sense)) in enumerate(PARALLEL.items(), start=1):
        others = [name for name in PARALLEL if name != column]
        part = raw[(raw[others] < LOWEST_KPA).all(axis=1)]
        part = part.assign(place=part["s_mm"].round() * 1000 + part["w_deg"].round())
        part = part.sort_values(["place", "t_s"], kind="stable")
        first = part.iloc[0]
        table = pd.DataFrame(
            {
                "sample": number,
                "gamma_deg": gamma,
                "length_mm": LENGTH_MM,
                "inner_radius_mm": INNER_MM,
                "outer_radius_mm": OUTER_MM,
                "step": part.groupby("place").cumcount(),
                "elongation_mm": part["s_mm"].round(),
                "twist_deg": sense * part["w_deg"].round(),
                "pressure_kpa": part[column],
                "force_n": -(part["F_raw_N"] - first["F_raw_N"]),
                "moment_nmm": -1000 * sense * (part["M_raw_Nm"] - first["M_raw_Nm"]),
                "buckled": 0,
            }
        )
        parts.append(table)
    return pd.concat(parts, ignore_index=True)


def discover(table: Path, folder: Path) -> dict:
    """discovery.json of a search of the whole table."""
    command = [sys.executable, str(ROOT / "discover.py"), "data=csv", f"data.path={table}", "train=all"]
    command += ["data.accuracy=estimate", "figures=false", f"hydra.run.dir={folder}"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    content: dict = json.loads((folder / "discovery.json").read_text())
    return content


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, default=Path("outputs/real_readings"))
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    three = out / "parallel_3.csv"
    parallel(pd.read_csv(arguments.folder / "parallel_3" / "plateaus_test9.csv")).to_csv(three, index=False)
    tables = {"free70_single": arguments.folder / "free70_single" / "measurements.csv", "parallel_3": three}
    console, shown = Console(width=120), Table(title="Real measurements, with and without the suspected readings")
    for heading in ("data", "rows", "verdict", "effects", "E before %", "after %", "suspects"):
        shown.add_column(heading)
    for name, path in tables.items():
        once = discover(path.resolve(), out / name)
        found = {"as measured": once}
        marked = out / name / "marked.csv"
        if marked.exists():
            found["without them"] = discover(marked, out / f"{name}_without")
        for what, content in found.items():
            error = [f"{100 * content['error'][when]:.3g}" for when in ("before", "after")]
            effects = ", ".join(content["effects"])
            suspects = str(len(content["suspects"]))
            shown.add_row(f"{name}, {what}", str(content["rows"]), content["verdict"], effects, *error, suspects)
        for s in once["suspects"]:
            console.print(
                f"{name} line {s['line']}: {s['load']} {s['shown']:.3g} where {s['expected']:.3g} {s['unit']} was "
                f"expected ({s['sigmas']:+.0f} σ) {s['slip']}",
                markup=False,
            )
    console.print(shown)


if __name__ == "__main__":
    main()
