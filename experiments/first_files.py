"""python experiments/first_files.py FOLDER [--data FOLDER]: raw files as laboratories have them, one for each page of
docs/starts.md, and what a laboratory answers to the questions of `freelearn start`.

The muscle is measured (Martens & Boblan 2017, CC BY 4.0; freelearn/examples/README.md). The FREE, the three actuators
and the artery are simulated by the second physics of freelearn.testing.reference, each with something hidden in it. The
rubber is Treloar's (1944), of the folder of measured data.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
from scipy.io import savemat

from freelearn.testing.reference.other_beds import DESIGN_COLUMNS, measure, measure_block, nominal

ROOT = Path(__file__).resolve().parents[1]
NONE = np.nan
# What the simulated files are made with, and what is hidden in them.
FREE = (36.0, NONE, 98.4, 4.77, 6.74)
FREE_HIDDEN = {"friction_hysteresis": {"force": 0.6, "moment": 4e-3}}
THREE = {1: (40.0, NONE, 100.0, 5.0, 7.0), 2: (-40.0, NONE, 100.0, 5.0, 7.0), 3: (60.0, NONE, 104.0, 5.0, 6.6)}
THREE_HIDDEN = {2: {"fiber_misalignment": {"angle": 0.05}}}
RUBBER_PA, FIBERS_PA = 8e5, 2e7
ARTERY = (35.0, -35.0, 20.0, 1.4, 1.75)
ARTERY_HIDDEN = {"length_offset": {"length": 4e-4}}
WALL_PA, COLLAGEN_PA = 3e4, 1.5e5
ARTERY_ACCURACY = {
    "elongation_mm": 0.02, "twist_deg": 0.1, "pressure_kpa": 0.05, "force_n": 2e-3, "moment_nmm": 0.01,
    "outer_diameter_mm": 0.01,
}  # fmt: skip
MMHG = 0.133322
# File → what is typed, in the order of the questions; an empty line takes what is proposed.
ANSWERS = {
    "Muskel.xlsx": ["", "", "27", "y", "300", "", "+1.5", "0", "y", "y"],
    "free.mat": ["", "", "36", "n", "98.4", "4.77", "6.74", "n", "n"],
    "three.mat": ["", "1", "", "", "", "", "n", "", *[""] * 9, "kPa", "", "", "n", "n"],
    "Treloar.xlsx": ["", "1", "", ""],
    "Bahn.xlsx": ["", "", "", "", "y"],
    "artery.csv": ["", "35", "y", "20", "d 2.8", "+0.35", "0", "y"],
}


def muscle(path: Path) -> None:
    """A Festo muscle, in German and in bar, a pull positive. Its diameter stands above the readings, below them a mean
    that no program has calculated."""
    table = pd.read_csv(ROOT / "freelearn/examples/dmsp_20_300.csv")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "Kraft"
    for row in (
        ["Muskel DMSP-20-300"],
        ["Innendurchmesser [mm]", 20],
        [],
        ["Kontraktion [mm]", "Druck [bar]", "Kraft [N]"],
    ):
        sheet.append(row)
    for shortening, pressure, force in zip(
        -table["elongation_mm"], table["pressure_kpa"] / 100, -table["force_n"], strict=True
    ):
        sheet.append([float(shortening), float(pressure), float(abs(force))])
    sheet.append(["Mittelwert", None, f"=AVERAGE(C5:C{sheet.max_row})"])
    book.save(path)


def free(path: Path) -> None:
    """A FREE on a rig that sets length and twist, as vectors of MATLAB with their units in the names."""
    places = np.random.default_rng(3).permutation(_grid([-4, -2, 0, 2, 4], [-60, -30, 0, 30, 60]))
    pressures = np.r_[np.linspace(0, 70, 6), 42, 14, 0]
    table = measure(
        "kinematic", nominal("kinematic", {1: FREE}, places, pressures), RUBBER_PA, FIBERS_PA, FREE_HIDDEN, 3
    )
    names = ("dl_mm", "phi_deg", "P_kPa", "F_N", "M_Nmm")
    columns = ("elongation_mm", "twist_deg", "pressure_kpa", "force_n", "moment_nmm")
    savemat(path, {n: table[[c]].to_numpy() for n, c in zip(names, columns, strict=True)} | {"note": "rig 2"})


def three(path: Path) -> None:
    """Three FREEs side by side on one end block: a structure with a matrix of pressures and vectors of the designs."""
    places = np.random.default_rng(5).permutation(_grid([-3, -1, 1, 3], [-40, -15, 15, 40]))
    table = nominal("kinematic", {1: (NONE,) * 5}, places, np.zeros(12))
    table = table.drop(columns=[*DESIGN_COLUMNS, "pressure_kpa"])
    # One after the other is filled, the first with the others empty, the rest with the others half full.
    step = table["step"].to_numpy()
    for number in THREE:
        table[f"pressure_{number}_kpa"] = np.where(
            step // 4 == number - 1, step % 4 * 23.0, np.where(step < 4, 0.0, 35.0)
        )
    table = measure_block(table, THREE, RUBBER_PA, FIBERS_PA, THREE_HIDDEN, 4)
    angles, _, lengths, inner, outer = (np.array(x) for x in zip(*THREE.values(), strict=True))
    columns = {"z_mm": "elongation_mm", "phi_deg": "twist_deg", "Fz_N": "force_n", "Mz_Nmm": "moment_nmm"}
    readings = {name: table[[column]].to_numpy() for name, column in columns.items()}
    pressures = table[[f"pressure_{n}_kpa" for n in THREE]].to_numpy()
    savemat(path, {"exp": {"P": pressures, **readings, "Gamma": angles, "L": lengths, "Ri": inner, "Ro": outer}})


def rubber(path: Path, data: Path) -> None:
    """Treloar's three tests, a sheet each, strains in percent and stresses in kPa."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, title in (("UT", "uniaxial tension"), ("ET", "equibiaxial"), ("PS", "pure shear")):
        table = pd.read_csv(data / "rubber/treloar_1944" / f"{name}.csv")
        sheet = book.create_sheet(name)
        for row in ([f"natural rubber, {title}"], [], ["Strain [%]", "Stress [kPa]"]):
            sheet.append(row)
        for stretch, stress in zip(table["lambda"], table["P_MPa"], strict=True):
            sheet.append([round(100 * (stretch - 1), 2), round(1000 * stress, 2)])
    book.save(path)


def artery(path: Path) -> None:
    """A tube that is inflated at several stretches: mmHg, µm and mN in a file with semicolons."""
    places = np.stack([20.0 * np.array([0.3, 0.5, 0.2, 0.4]), np.zeros(4)], axis=1)
    table = nominal("inflation", {1: ARTERY}, places, MMHG * np.r_[10.0:150.0:10.0, 120.0:0.0:-20.0])
    table = measure("inflation", table, WALL_PA, COLLAGEN_PA, ARTERY_HIDDEN, 6, ARTERY_ACCURACY)
    made = pd.DataFrame(
        {
            "axial stretch": 1 + table["elongation_mm"] / 20.0,
            "pressure [mmHg]": table["pressure_kpa"] / MMHG,
            "OD [um]": 1000 * table["outer_diameter_mm"],
            "force [mN]": -1000 * table["force_n"],
        }
    )
    path.write_text("# vessel 4, descending\n" + made.round(4).to_csv(index=False, sep=";"))


def trajectory(path: Path) -> None:
    """A length that goes back and forth, and a load that swings, of which the pressures are wanted."""
    book = openpyxl.Workbook()
    sheet = book.active
    for row in (["Solltrajektorie"], [], ["Zeit [s]", "Kontraktion [mm]", "Zugkraft [N]"]):
        sheet.append(row)
    for step in range(41):
        angle = 2 * np.pi * step / 40
        row = (0.05 * step, 30 - 12 * np.cos(angle), 300 + 100 * np.sin(angle))
        sheet.append([round(float(value), 3) for value in row])
    book.save(path)


def _grid(first: list[float], second: list[float]) -> np.ndarray:
    return np.stack([x.ravel() for x in np.meshgrid(first, second, indexing="ij")], axis=1).astype(np.float64)


MADE = {"Muskel.xlsx": muscle, "Bahn.xlsx": trajectory, "free.mat": free, "three.mat": three, "artery.csv": artery}


def main() -> None:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--data", type=Path, help="where the measured data lie; without it no rubber")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    for name, make in MADE.items():
        make(asked.folder / name)
    if asked.data:
        rubber(asked.folder / "Treloar.xlsx", asked.data)


if __name__ == "__main__":
    main()
