"""The measured data sets: where each lies, and the two commands that take it to a report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from freelearn.data.beds import BEDS
from freelearn.data.table.measurement_table import read_table
from freelearn.data.table.members_table import read_members


@dataclass(frozen=True)
class RealSet:
    """recipe: of experiments/recipes; raw: in the folder of the data; bed: of data.bed; overrides: of discover.py."""

    recipe: str
    raw: str
    bed: str
    overrides: tuple[str, ...]
    members: bool = False

    def table(self, out: Path) -> Path:
        """What intake.py writes."""
        return out / f"{self.recipe}.csv"

    def members_table(self, out: Path) -> Path | None:
        """The actuators of an end block, which it writes beside."""
        return out / f"{self.recipe}_members.csv" if self.members else None

    def read(self, out: Path) -> pd.DataFrame:
        """The table that it wrote."""
        beside = self.members_table(out)
        return read_table(self.table(out), BEDS[self.bed], read_members(beside) if beside else None).table

    def commands(self, data: Path, out: Path) -> list[list[str]]:
        """intake.py, then discover.py, as argument lists."""
        raw, recipe = data / self.raw, Path("experiments") / "recipes" / f"{self.recipe}.yaml"
        beside = self.members_table(out)
        members = [f"data.members={beside}"] if beside else []
        return [
            ["intake.py", f"data.path={raw}", f"recipe={recipe}", f"out={self.table(out)}"],
            [
                *("discover.py", "data=csv", f"data.path={self.table(out)}", f"data.bed={self.bed}", *members),
                *(*self.overrides, f"hydra.run.dir={out / self.recipe}"),
            ],
        ]


# The braid's angle stands in no data sheet, so it is fitted; the muscles' load cells and gauges were calibrated.
BRAID, CALIBRATED = "effects=[fiber_misalignment]", "ruled_out=[force_gain,pressure_gain]"
ESTIMATE = "data.accuracy=estimate"
# Actuators cut from one stock have one wall thickness, one angle error, and so on.
ONE_STOCK = "per_sample=false"
SETS = (
    RealSet(
        "dmsp_20_300",
        "braided_muscles/dmsp_20_300.csv",
        "isometric",
        (
            *(BRAID, CALIBRATED, "data.accuracy.force_n=3.0"),
            *("data.accuracy.elongation_mm=0.3", "data.accuracy.pressure_kpa=1.0"),
        ),
    ),
    RealSet(
        "festo_10mm",
        "braided_muscles/festo_10mm_isometric.csv",
        "isometric",
        (BRAID, "ruled_out=[force_gain,pressure_gain]", ONE_STOCK, ESTIMATE),
    ),
    RealSet("free70_single", "free70_single/raw.csv", "kinematic", (ESTIMATE,)),
    RealSet("parallel_3", "parallel_3/plateaus_test9.csv", "kinematic", (ONE_STOCK, ESTIMATE), members=True),
    RealSet("parallel_free_end", "parallel_free_end/steps.csv", "dead_load", (ONE_STOCK, ESTIMATE), members=True),
    RealSet("torsion_4angles", "torsion_4angles", "dead_load", (ONE_STOCK, ESTIMATE)),
    # One artery: the others have walls of their own, which no parameter is shared with.
    RealSet(
        "vessels", "vessels/inflation_extension.csv", "inflation", (BRAID, "material=artery", "train=sample5", ESTIMATE)
    ),
)
