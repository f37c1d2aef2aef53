"""python experiments/rubber_specimens.py FOLDER --out OUT: what tests of rubber alone say about the wall's energy.

FOLDER holds tests that others measured: James_1975.csv, Katashima_2012.csv, latex_tube_elongation_2psi.csv, and
treloar_1944 and meunier_2008 by mode. Each becomes a specimen table in OUT; the specimens command compares all
combinations of effects on it, and fits the one that the tests ask for. Nothing is written to FOLDER.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from freelearn.data.specimen_schema import MODES
from freelearn.fitting.rubber_effects import NEO_HOOKEAN, asked_for, held_out_errors

COLUMNS = ["mode", "specimen", "stretch", "stretch_2", "stress_mpa", "stress_2_mpa"]
# The same laboratory's tubing [m]; its notes name a radius of 3/16 in and a wall of 1/16 in.
INNER_M, OUTER_M = 3 / 16 * 0.0254, 1 / 4 * 0.0254
NEWTON_PER_POUND = 4.4482216


def james(path: Path) -> pd.DataFrame:
    """Natural rubber [MPa], in one direction and, with λ₂ held, in two (James, Green & Simpson 1975).

    S22 at λ₂ = 1.5 is left blank: it repeats that at λ₂ = 1.7, and exceeds S11 by 15 % where the stretches are equal.
    """
    raw = pd.read_csv(path)
    table = raw.rename(columns={"F11": "stretch", "F22": "stretch_2", "S11": "stress_mpa", "S22": "stress_2_mpa"})
    table.loc[raw["mode"] == "BT_lambda_1d5", "stress_2_mpa"] = np.nan
    table["specimen"] = [f"λ₂ = {x}" if mode != "UT" else "" for mode, x in zip(raw["mode"], raw["F22"], strict=True)]
    return table.assign(mode=raw["mode"].str[:2])[COLUMNS]


def katashima(path: Path) -> pd.DataFrame:
    """A tetra-PEG gel [kPa → MPa] in ET, PS and with λ₂ = ½ + ½ λ₁ (Katashima et al. 2012).

    F11 and F22 are the λ₁ at which the file's source read S11 and S22 off two curves, as its code shows and the
    stresses agree with: F22 is no stretch across, and each row is two, with one stress each. ET has one curve only.
    """
    raw = pd.read_csv(path)
    one = pd.DataFrame({"mode": raw["mode"], "stretch": raw["F11"], "stress_mpa": raw["S11"] / 1000})
    two = pd.DataFrame({"mode": raw["mode"], "stretch": raw["F22"], "stress_2_mpa": raw["S22"] / 1000})
    table = pd.concat([one, two[two["mode"] != "ET"]]).sort_values("stretch", kind="stable")
    across = {"BT": 0.5 + 0.5 * table["stretch"], "ET": table["stretch"], "PS": 1.0}
    table["stretch_2"] = np.select([table["mode"] == m for m in across], list(across.values()))
    return table.assign(specimen="")[COLUMNS]


def latex(path: Path) -> pd.DataFrame:
    """A plain latex tube that weights stretch, at 2 psi inside: load over the section at rest, series by series.

    The pressure is left out: it lengthens the closed tube by 0.2 % before the first weight and makes its modulus look
    0.2 % smaller (by the continuum model without a fiber), where strains at one load differ by tens of percent.
    """
    raw = pd.read_csv(path)
    area = np.pi * (OUTER_M**2 - INNER_M**2)
    table = pd.DataFrame(
        {"stretch": 1 + raw["Strain"], "stress_mpa": raw["Load (lbs)"] * NEWTON_PER_POUND / area / 1e6}
    )
    # Each series begins without a load.
    series = (raw["Load (lbs)"] == 0).cumsum()
    table = table.assign(mode="UT", specimen=[f"series {n}" for n in series], stretch_2=np.nan, stress_2_mpa=np.nan)
    return table[COLUMNS]


def by_mode(folder: Path) -> pd.DataFrame:
    """Files UT.csv, ET.csv and PS.csv (lambda, P_MPa) as one table."""
    parts = [pd.read_csv(folder / f"{mode}.csv").assign(mode=mode) for mode in ("UT", "ET", "PS")]
    return pd.concat(parts).rename(columns={"lambda": "stretch", "P_MPa": "stress_mpa"}).reindex(columns=COLUMNS)


MATERIALS: dict[str, Callable[[Path], pd.DataFrame]] = {
    "treloar_1944": by_mode,
    "meunier_2008": by_mode,
    "James_1975.csv": james,
    "Katashima_2012.csv": katashima,
    "latex_tube_elongation_2psi.csv": latex,
}


def specimens(table: Path, *options: str) -> None:
    """Runs the command on a table."""
    command = [sys.executable, "-m", "freelearn.specimens", str(table), *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def judged(table: Path, out: Path) -> list[str]:
    """A row of the table: modes, stresses, effects asked for, and errors in % before and after, fitted and held out."""
    specimens(table, "--compare", "--out", str(out))
    compared = pd.read_csv(
        out / "comparison.csv", dtype={"held_out": "str"}, keep_default_na=False, na_values={"error": ""}
    )
    together = compared[compared["held_out"] == ""]
    squares = (together["error"] ** 2 * together["n"]).groupby(together["effects"]).sum()
    fitted = (squares / together.groupby("effects")["n"].sum()) ** 0.5
    held_out = held_out_errors(compared)
    asked = asked_for(held_out).index if len(held_out) else pd.Index([NEO_HOOKEAN])
    effects = [] if asked[0] == NEO_HOOKEAN else asked[0].split()
    specimens(table, "--out", str(out), *(["--effects", *effects] if effects else []))
    modes = together.loc[together["effects"] == NEO_HOOKEAN]
    errors = [fitted[NEO_HOOKEAN], fitted[asked[0]], *(held_out.get(name, np.nan) for name in (NEO_HOOKEAN, asked[0]))]
    missing = " or ".join(name.replace(" ", " + ") for name in asked) if len(held_out) else "one mode cannot tell"
    short = " ".join(MODES[mode].short for mode in modes["mode"])
    shown = ["–" if np.isnan(error) else f"{100 * error:.1f}" for error in errors]
    return [short, str(modes["n"].sum()), missing, *shown]


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, default=Path("outputs/rubber_specimens"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    shown = Table(title="Rubber alone: E of the neo-Hookean energy, and with the effects that the tests ask for")
    for heading in ("material", "modes", "stresses", "asks for", "fitted %", "→", "held out %", "→"):
        shown.add_column(heading)
    for name, convert in MATERIALS.items():
        stem = Path(name).stem
        table = arguments.out / f"{stem}.csv"
        convert(arguments.folder / name).to_csv(table, index=False)
        shown.add_row(stem, *judged(table, arguments.out / stem))
    Console(width=140).print(shown)


if __name__ == "__main__":
    main()
