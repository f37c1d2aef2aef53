"""python experiments/rubber_over_time.py FOLDER --out OUT: what tests of soft rubbers over time say of one left out.

FOLDER holds recordings that others measured: vhb4910 (holds at four stretches, pulls and returns at two rates) and
oca_adhesive (shear at three rates; shear in steps with holds at three rates, and up and back once). Each set becomes a
specimen table in OUT; the specimens command predicts every strain, or rate, from the others, which alone decide how the
rubber relaxes. Of steps the stresses of one are blank in all recordings, and predicted, too. Nothing is written to
FOLDER.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from freelearn.physics.models.relaxation import Relaxation

# Between the clamps [mm], and the section [mm²], which the files do not give: shares of a stress do not depend on it.
LENGTH, SECTION = 80.0, 25.0
# A strip that comes back hangs loose from where it carries less than this share of its largest force.
LOOSE = 0.03
# Amounts of shear that the adhesive is held at, each so much further than the one before; readings lie as close.
STEP, STEPS_LEFT_OUT, CLOSE = 2.0, (2.0, 4.0, 6.0, 8.0), 0.02
# Shear at one rate, and in steps with holds: columns of time, stress [kPa] and amount of shear.
AT_ONE_RATE, IN_STEPS = (0, 2, 3), (0, 3, 4)


def numbers(path: Path) -> np.ndarray:
    """The rows of a file that hold numbers alone, (N, k)."""
    rows = pd.read_csv(path, header=None, dtype=str).apply(pd.to_numeric, errors="coerce")
    return rows.dropna().to_numpy(np.float64)


def strip(path: Path, name: str) -> pd.DataFrame:
    """A strip of VHB 4910 in tension: time s, displacement mm, force N."""
    time, moved, force = numbers(path).T
    stress = force / SECTION
    back = np.arange(len(force)) > int(np.argmax(moved))
    loose = np.flatnonzero(back & (force < LOOSE * force.max()))
    stress[loose[:1].min(initial=len(force)) :] = np.nan
    columns = {"time_s": time, "stretch": 1 + moved / LENGTH, "stress_mpa": stress}
    return pd.DataFrame({"mode": "UT", "specimen": name, **columns})


def sheared(path: Path, name: str, columns: tuple[int, int, int]) -> pd.DataFrame:
    """A layer of adhesive in simple shear, which is at rest before its first row."""
    time, stress, amount = numbers(path)[:, columns].T
    if time[0] > 0:
        time, stress, amount = (np.concatenate([[0.0], column]) for column in (time, stress, amount))
    columns_of = {"time_s": time, "shear": amount, "stress_mpa": stress / 1000}
    return pd.DataFrame({"mode": "SS", "specimen": name, **columns_of})


def holds(folder: Path) -> pd.DataFrame:
    """Strips pulled at 0.25 /s, then held for half an hour."""
    names = {"1d5": "held at 1.5", "2d5": "held at 2.5", "3d5": "held at 3.5", "5d0": "held at 5"}
    return pd.concat(strip(folder / f"vhb4910/relaxation_{of}.csv", name) for of, name in names.items())


def returns(folder: Path) -> pd.DataFrame:
    """Strips pulled to two stretches at two rates, and back."""
    names = {
        f"{rate}_{to}": f"{rate.replace('d', '.')} /s to {to[0]}" for rate in ("0d01", "0d05") for to in ("2d0", "3d0")
    }
    return pd.concat(strip(folder / f"vhb4910/uniaxial-loading-unloading_{of}.csv", name) for of, name in names.items())


def rates(folder: Path) -> pd.DataFrame:
    """Layers sheared once, at three rates."""
    path = "oca_adhesive/monotonic-shear__monotonic_shear_{}.csv"
    names = {"0d01": "0.01 /s", "0d1": "0.1 /s", "1": "1 /s"}
    return pd.concat(sheared(folder / path.format(of), name, AT_ONE_RATE) for of, name in names.items())


def steps(folder: Path) -> pd.DataFrame:
    """Layers sheared in five steps at three rates, each held for some minutes."""
    path = "oca_adhesive/cyclic-shear-relaxation__shear_relaxation_{}.csv"
    names = {"1": "steps at 0.017 /s", "0d1": "steps at 0.078 /s", "5": "steps at 0.083 /s"}
    return pd.concat(sheared(folder / path.format(of), name, IN_STEPS) for of, name in names.items())


def back(folder: Path) -> pd.DataFrame:
    """A layer that comes back in steps."""
    path = folder / "oca_adhesive/cyclic-shear-relaxation__shear_relaxation.csv"
    return sheared(path, "steps up and back", IN_STEPS)


def up_and_back(folder: Path) -> pd.DataFrame:
    """All layers sheared in steps, the one that comes back last."""
    return pd.concat([steps(folder), back(folder)])


def each(table: pd.DataFrame) -> list[list[str]]:
    """Every recording alone."""
    return [[name] for name in table["specimen"].unique()]


def by_rate(table: pd.DataFrame) -> list[list[str]]:
    """Recordings whose names begin alike."""
    names = table["specimen"].unique()
    return [
        [name for name in names if name.startswith(rate)] for rate in dict.fromkeys(n.split(" to ")[0] for n in names)
    ]


Groups = Callable[[pd.DataFrame], Sequence[Sequence[str]]]
SETS: Mapping[str, tuple[Callable[[Path], pd.DataFrame], Groups]] = {
    "VHB 4910, holds": (holds, each),
    "VHB 4910, pulled and back": (returns, by_rate),
    "adhesive, sheared": (rates, each),
    "adhesive, in steps": (steps, each),
    "adhesive, up and back": (up_and_back, lambda table: each(table)[-1:]),
    "adhesive, back alone": (back, lambda _: [[]]),
}


def specimens(table: Path, out: Path, *options: str) -> dict[str, Any]:
    """What the command writes of a table."""
    command = [sys.executable, "-m", "freelearn.specimens", str(table), "--out", str(out), *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    found: dict[str, Any] = json.loads((out / "specimen.json").read_text(encoding="utf-8"))
    return found


def row(found: Mapping[str, Any], left_out: str, errors: Iterable[float]) -> list[str]:
    """Of the table: what was left out, the relaxation that the others ask for, and errors in %."""
    of = found["relaxation"]
    shown = ", ".join(f"{100 * error:.1f}" for error in errors)
    return [left_out, Relaxation(of["kind"], of["softened"]).words, f"{100 * found['error']:.1f}", shown]


def judged(table: Path, out: Path, left_out: Sequence[str]) -> list[str]:
    """A row of recordings that are left out."""
    found = specimens(table, out, *(["--held-out", *left_out] if left_out else []))
    return row(found, ", ".join(left_out) or "nothing", (found["modes"][name]["error"] for name in left_out))


def judged_step(rows: pd.DataFrame, out: Path, amount: float) -> list[str]:
    """A row of one step, to an amount of shear: its stresses are blank in all recordings."""
    step = (rows["shear"] > amount - STEP + CLOSE) & (rows["shear"] < amount + CLOSE)
    table = out.with_suffix(".csv")
    rows.assign(stress_mpa=rows["stress_mpa"].mask(step)).to_csv(table, index=False)
    found = specimens(table, out)
    curves = pd.read_csv(out / "curves.csv")
    asked = rows[step].merge(curves[curves["source"] != "measured"], on=["specimen", "time_s"], suffixes=("", "_found"))
    misfit = (asked["stress_mpa_found"] - asked["stress_mpa"]) / asked["specimen"].map(
        rows.groupby("specimen")["stress_mpa"].max()
    )
    errors = (misfit**2).groupby(asked["specimen"], sort=False).mean() ** 0.5
    return row(found, f"the step to a shear of {amount:g}", errors)


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, default=Path("outputs/rubber_over_time"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    shown = Table(title="Rubber over time, neo-Hookean at rest: E of what was left out, predicted from the others")
    for heading in ("set", "left out", "relaxation", "fitted %", "left out %"):
        shown.add_column(heading)
    for name, (convert, groups) in SETS.items():
        rows = convert(arguments.folder)
        stem = name.replace(", ", "_").replace(" ", "_").lower()
        table = arguments.out / f"{stem}.csv"
        rows.to_csv(table, index=False)
        for number, left_out in enumerate(groups(rows), 1):
            shown.add_row(name, *judged(table, arguments.out / f"{stem}_{number}", left_out))
    rows = steps(arguments.folder)
    for amount in STEPS_LEFT_OUT:
        shown.add_row("adhesive, in steps", *judged_step(rows, arguments.out / f"adhesive_step_{amount:g}", amount))
    Console(width=140).print(shown)


if __name__ == "__main__":
    main()
