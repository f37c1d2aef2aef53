"""The measured data sets: where each lies, and the two commands that take it to a report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RealSet:
    """recipe: of experiments/recipes; raw: in the folder of the data; overrides: of discover.py."""

    recipe: str
    raw: str
    overrides: tuple[str, ...]
    members: bool = False

    def commands(self, data: Path, out: Path) -> list[list[str]]:
        """intake.py, then discover.py, as argument lists."""
        table = out / f"{self.recipe}.csv"
        raw, recipe = data / self.raw, Path("experiments") / "recipes" / f"{self.recipe}.yaml"
        members = [f"data.members={out / f'{self.recipe}_members.csv'}"] if self.members else []
        return [
            ["intake.py", f"data.path={raw}", f"recipe={recipe}", f"out={table}"],
            [
                *("discover.py", "data=csv", f"data.path={table}", *members, *self.overrides),
                f"hydra.run.dir={out / self.recipe}",
            ],
        ]


# The braid's angle stands in no data sheet, so it is fitted; the muscles' load cells and gauges were calibrated.
BRAID, CALIBRATED = "effects=[fiber_misalignment]", "ruled_out=[force_gain,pressure_gain]"
ESTIMATE = "data.accuracy=estimate"
SETS = (
    RealSet(
        "dmsp_20_300",
        "braided_muscles/dmsp_20_300.csv",
        (
            *("data.bed=isometric", BRAID, CALIBRATED),
            *("data.accuracy.elongation_mm=0.3", "data.accuracy.pressure_kpa=1.0", "data.accuracy.force_n=3.0"),
        ),
    ),
    RealSet(
        "festo_10mm",
        "braided_muscles/festo_10mm_isometric.csv",
        ("data.bed=isometric", BRAID, "ruled_out=[force_gain,pressure_gain,moment_gain]", "per_sample=false", ESTIMATE),
    ),
    RealSet("free70_single", "free70_single/raw.csv", (ESTIMATE,)),
    RealSet("parallel_3", "parallel_3/plateaus_test9.csv", (ESTIMATE,), members=True),
    RealSet("parallel_free_end", "parallel_free_end/steps.csv", ("data.bed=dead_load", ESTIMATE), members=True),
    RealSet("torsion_4angles", "torsion_4angles", ("data.bed=dead_load", "per_sample=false", ESTIMATE)),
    RealSet("vessels", "vessels/inflation_extension.csv", ("data.bed=inflation", ESTIMATE)),
)
