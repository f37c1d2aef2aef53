"""python experiments/twisted_tube.py FOLDER: a twisted tube's turning from tests of its own stock, and what mends it.

FOLDER holds a log of a drawn PVC tube, twisted by 15° and free at its end (15deg_FreeTorsion_Sample_2.csv; docs/logs.md
says where it comes from), and in constituent/ tests of the same stock: pulled along the draw (E1) and turned (Shear).
From the first strains of a pull comes E₁ = 6 C1 + 8 C2, from the turning, both ways, G = 2 C1. Errors are root mean
squares of the twist. Fitted is the first half of the log, the second is predicted.
"""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import torch
from rich.console import Console
from rich.table import Table

from freelearn.data.beds import BED, DEAD_LOAD
from freelearn.data.rows import Rows
from freelearn.data.table.log_tables import thinned
from freelearn.fitting.fit import fit
from freelearn.fitting.options import FitOptions
from freelearn.physics.models.build import build_model

# Of the tube, mm; what a pulled piece's section is, mm², and how long one is that is turned, m.
DESIGN = {"gamma_deg": 15.0, "length_mm": 15.0, "inner_radius_mm": 0.425, "outer_radius_mm": 0.925}
SECTION, TURNED = 1.12, 9.5e-3
RADII = 0.9e-3, 0.425e-3
# Strain up to which a pull counts, from a twentieth of it on: beyond, the stock yields.
SMALL = 0.01
SPOOL, KPA = 3.0, 6.894757
# Rows a second; the first rows, at rest, which are the zeros of both; share of the log that is fitted.
RATE, REST, FITTED = 20.0, 200, 0.5
OPTIONS = FitOptions("levenberg_marquardt", max_epochs=80, restarts=1, patience=6)
SETS = ((), ("creep",), ("creep", "second_creep"), ("creep", "limited_extensibility"))


def stiffness(path: Path) -> float:
    """E₁ of a pulled piece, Pa."""
    _, force, gap = _numbers(path)
    strain, stress = gap / gap[0] - 1, -(force - force[:5].mean()) / SECTION * 1e6
    first = slice(int(np.argmax(strain > SMALL / 20)), int(np.argmax(strain > SMALL)))
    return float(np.polyfit(strain[first], stress[first], 1)[0])


def rigidity(path: Path) -> float:
    """G of a piece that is turned both ways, Pa: from one end of the loop to the other."""
    _, torque, angle = _numbers(path)
    polar = np.pi / 2 * (RADII[0] ** 4 - RADII[1] ** 4)
    return float(np.ptp(torque) * 1e-6 / np.ptp(angle) * TURNED / polar)


def _numbers(path: Path) -> np.ndarray:
    """Time, force or torque, and gap or angle, (3, n); where a cell is no number, the last one."""
    found: np.ndarray = pd.read_csv(path, skiprows=[1]).apply(pd.to_numeric, errors="coerce").ffill().to_numpy().T
    return found


def log(folder: Path) -> pd.DataFrame:
    """The tube's recording, thinned. It turns back, against its fibers, as the pressure rises: here negative."""
    raw = pd.read_csv(folder / "15deg_FreeTorsion_Sample_2.csv")
    spool = raw["spool_displacement_mm"]
    table = pd.DataFrame(
        {
            "sample": 1, "step": np.arange(len(raw)), "time_s": raw["time_s"], "run": 1, "elongation_mm": np.nan,
            "twist_deg": np.degrees((spool - spool[:REST].median()) / SPOOL),
            "pressure_kpa": (raw["pressure_psi_raw"] - raw["pressure_psi_raw"].quantile(0.01)) * KPA,
            "force_n": 0.0, "moment_nmm": 0.0, "buckled": 0, **DESIGN, BED: DEAD_LOAD.name,
        }
    )  # fmt: skip
    return thinned(table, RATE)[0]


def main(folder: Path) -> None:
    """Runs the command."""
    torch.set_num_threads(1)
    logging.getLogger("lightning.pytorch").setLevel(logging.ERROR)
    console, pieces = Console(width=150), folder / "constituent"
    pulled = [stiffness(path) for path in sorted(pieces.glob("E1_*.csv"))]
    turned = [rigidity(path) for path in sorted(pieces.glob("Shear_*.csv"))]
    for name, each in (("E1", pulled), ("G", turned)):
        console.print(f"{name} of {len(each)} pieces: {', '.join(f'{x / 1e6:.0f}' for x in each)} MPa")
    c1 = float(np.median(turned)) / 2
    c2 = (float(np.median(pulled)) - 6 * c1) / 8
    table = log(folder)
    rows, twist = Rows.from_table(table), table["twist_deg"].to_numpy()
    early = np.arange(len(table)) < FITTED * len(table)
    heads = ("fitted", "first half", "second half", "largest twist", "C1, C2 at rest; at once [MPa]", "values")
    shown, most = Table("model", *heads), table["pressure_kpa"].max() / 1e3
    console.print(f"measured: at most {-np.nanmin(twist):.1f}° at {most:.2f} MPa, {len(table)} rows")

    def told(name: str, count: int, effects: tuple[str, ...], values: dict[str, float] | None) -> None:
        model = build_model("continuum", values or {"C1": 2e6, "C2": 1e7}, effects=effects)
        if values is None:
            # One recording: what is not fitted has no reading, and its pressures are known all the same.
            seen = Rows.from_table(table.assign(twist_deg=np.where(early, twist, np.nan)))
            fit(model, seen, seen[torch.arange(0)], OPTIONS, seed=0)
        with torch.no_grad():
            found = np.degrees(model(rows.states).loads[:, 1].numpy())
        left = [float(np.sqrt(np.nanmean((found - twist)[part] ** 2))) for part in (early, ~early)]
        fitted = model.scalars()
        at_once = float(np.prod([1 + fitted[f"{e}.share"] for e in effects if e.endswith("creep")]))
        rest = [fitted[n] / 1e6 for n in ("C1", "C2")]
        shown.add_row(
            name, str(count), *(f"{x:.2f}°" for x in left), f"{-np.nanmin(found):.1f}°",
            f"{rest[0]:.2g}, {rest[1]:.2g}; {at_once * rest[0]:.2g}, {at_once * rest[1]:.2g}",
            ", ".join(f"{n} {v:.3g}" for n, v in fitted.items() if "." in n),
        )  # fmt: skip

    told("nothing fitted", 0, (), {"C1": c1, "C2": c2})
    for effects in SETS:
        count = len(build_model("continuum", effects=effects).vector())
        told(" + ".join(["continuum", *effects]), count, effects, None)
    console.print(shown)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
