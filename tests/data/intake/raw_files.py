"""A laboratory's small file with its recipe, and what intake makes of changed ones."""

from __future__ import annotations

import json
from io import StringIO
from pathlib import Path

import pandas as pd
from rich.console import Console

from freelearn.api.settings.settings import IntakeData, IntakeSettings
from freelearn.cli.intake_command import take_in

HEADER = "t_s,dl_mm,phi_deg,P_kPa,F_N,M_Nmm"
ROWS = [
    (0.0, 0, 0, 0.0, -0.11, 0.35),
    (1.0, 0, 0, 31.2, -2.25, -8.15),
    (2.0, 0, 0, 62.5, -4.75, -17.45),
    (3.0, 2.5, 0, 0.0, -3.15, 0.55),
    (4.0, 2.5, 0, 31.1, -5.05, -8.65),
    (5.0, 2.5, 0, 62.4, -7.35, -18.05),
    (6.0, 2.5, 20, 0.0, -3.05, -12.15),
    (7.0, 2.5, 20, 31.3, -4.95, -20.75),
    (8.0, 2.5, 20, 62.6, -7.25, -30.25),
]
RECIPE = """\
bed: kinematic
constants: {gamma_deg: 40, length_mm: 90, inner_radius_mm: 4.77, outer_radius_mm: 6.35}
columns:
  elongation_mm: {from: dl_mm, unit: mm}
  twist_deg: {from: phi_deg, unit: deg}
  pressure_kpa: {from: P_kPa, unit: kPa}
  force_n: {from: F_N, unit: N}
  moment_nmm: {from: M_Nmm, unit: N·mm}
"""


def raw_text(header: str = HEADER, separator: str = ",", decimal: str = ".") -> str:
    """The file, written in some way."""
    lines = [separator.join(str(value).replace(".", decimal) for value in row) for row in ROWS]
    return "\n".join([header.replace(",", separator), *lines]) + "\n"


def with_cell(row: int, column: str, text: str) -> str:
    """The file with another text in one cell; rows count from 0."""
    lines = raw_text().splitlines()
    cells = lines[row + 1].split(",")
    cells[HEADER.split(",").index(column)] = text
    lines[row + 1] = ",".join(cells)
    return "\n".join(lines) + "\n"


def taken(
    folder: Path, content: bytes | str, recipe: str = RECIPE, name: str = "raw.csv"
) -> tuple[pd.DataFrame, list[str]]:
    """The table that intake writes of a file, and its warnings. Raises UserError."""
    raw = folder / name
    raw.write_bytes(content if isinstance(content, bytes) else content.encode())
    return taken_path(folder, raw, recipe)


def taken_path(folder: Path, raw: Path, recipe: str = RECIPE) -> tuple[pd.DataFrame, list[str]]:
    """The same of a path."""
    path = folder / "recipe.yaml"
    path.write_text(recipe)
    out = folder / "out" / "table.csv"
    take_in(IntakeSettings(IntakeData(raw), path, out), folder / "run", Console(file=StringIO(), width=120))
    made = json.loads((folder / "out" / "table_provenance.json").read_text())
    return pd.read_csv(out), made["warnings"]
