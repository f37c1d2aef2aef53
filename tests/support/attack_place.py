"""A folder with all that commands read, for attacks on where they write."""

from pathlib import Path
from typing import Any

from fitted_folders import continuum, folder_of, grid, shown
from small_runs import make_csv, run

RAW = "dl_mm,phi_deg,P_kPa,F_N,M_Nmm\n0,0,0,-0.1,0.3\n0,0,30,-2.2,-8.1\n2,0,0,-3.1,0.5\n2,0,30,-5.0,-8.6\n"


def make_place(folder: Path, **fitted: Any) -> Path:
    """A table, raw readings, a fitted run and a sweep to gather, and a file where a folder might be meant.

    fitted: what else folder_of writes of the fitted run."""
    make_csv(folder / "table.csv")
    (folder / "raw.csv").write_text(RAW)
    (folder / "file").write_text("kept as it is")
    run(folder / "sweep/0", *of(folder), "train=constituent", "figures=false")
    model = continuum()
    folder_of(folder / "fitted", model, shown(model, grid()), **fitted)
    return folder


def of(folder: Path) -> list[str]:
    """Words that name its table."""
    return ["data=csv", f"data.path={folder / 'table.csv'}", "train=all"]
