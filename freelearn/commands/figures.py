"""python -m freelearn.figures FOLDER: the paper's other figures and tables from a sweep's or a run's folder."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table

from freelearn.commands.command_line import program
from freelearn.errors import UserError
from freelearn.files import write_whole
from freelearn.measurements.states import kinematic_state
from freelearn.models.base import Model
from freelearn.models.build import load_model
from freelearn.models.own import load_own_code
from freelearn.render.png.admissible import admissible
from freelearn.render.png.canvas import save
from freelearn.render.png.curves import curves
from freelearn.render.png.load_vectors import load_vectors
from freelearn.render.terminal.table import rich_table
from freelearn.results.admissible import admissible_table
from freelearn.results.curve import state_curves
from freelearn.results.curve_panels import curve_numbers
from freelearn.results.load_vectors import load_vector_table
from freelearn.results.run_files import check_folder
from freelearn.results.states import pick_states, places, rows_of_set, state_title
from freelearn.results.tables import DisplayTable

DESIGN = ["sample", "gamma_deg", "length_mm", "inner_radius_mm", "outer_radius_mm"]


def draw_folder(folder: Path, out: Path, train: str, state: Sequence[float] | None, console: Console) -> None:
    """Writes admissible, load_vectors and curves (.png and .csv), designs.csv and parameters.csv; prints the tables.

    folder: of a sweep or a run. train: the training set whose models are drawn, "" for the first one. state: sample,
    elongation [mm] and twist [deg], None for the middling one. Raises UserError.
    """
    load_own_code()
    runs = _runs(folder)
    check_folder(out)
    table = pd.read_csv(runs[0]["folder"] / "predictions.csv")
    simulated = bool(runs[0]["data"]["simulated"])
    save(admissible(table, simulated), admissible_table(table), out / "admissible.png")
    save(load_vectors(table, simulated), load_vector_table(table), out / "load_vectors.png")
    train = train or str(runs[0]["train"])
    models = _models(runs, train)
    rows = _rows(table, state, train)
    ((measured, lines),) = state_curves(models, table, [rows])
    title = f"fitted on {train}: {state_title(measured)}"
    save(curves(measured, lines, title, simulated), curve_numbers(measured, lines), out / "curves.png")

    designs = table[DESIGN].drop_duplicates("sample").sort_values("sample")
    counts = table.groupby("sample")["buckled"].agg(rows="size", unbuckled=lambda b: int((b == 0).sum()))
    designs = designs.merge(counts, left_on="sample", right_index=True)
    _write(designs, out / "designs.csv")
    console.print(_shown(designs, "designs"))
    fitted = parameters(runs)
    _write(fitted, out / "parameters.csv")
    if len(fitted):
        console.print(_shown(fitted, "fitted parameters"))
        moved = spread(fitted)
        console.print(_shown(moved, "how far they move between training sets"))
        _write(moved, out / "spread.csv")
    for name in ("admissible", "load_vectors", "curves"):
        console.print(f"picture: {out / name}.png", markup=False, highlight=False, soft_wrap=True)


def _runs(folder: Path) -> list[dict[str, Any]]:
    """results.json of every run, each with its folder."""
    paths = [folder / "results.json"] if (folder / "results.json").exists() else sorted(
        folder.glob("*/results.json"), key=lambda path: path.parent.name.zfill(12)
    )  # fmt: skip
    if not paths:
        raise UserError(f"No results in {folder}: name the folder of a run or of a sweep.")
    try:
        runs = [json.loads(path.read_text(encoding="utf-8")) | {"folder": path.parent} for path in paths]
    except ValueError as problem:
        raise UserError(f"{folder}: a results.json is not JSON ({problem}).") from None
    if len({run["data"].get("sha256") or str(run["data"].get("seed")) for run in runs}) > 1:
        raise UserError(
            f"The runs in {folder} are about different data: name one run's folder, or a sweep over one table."
        )
    return runs


def _models(runs: Sequence[dict[str, Any]], train: str) -> dict[str, Model]:
    """One model per label that was fitted on the training set."""
    found: dict[str, Model] = {}
    for run in runs:
        if run["train"] == train:
            label = " + ".join([run["model"], *run["effects"]])
            found.setdefault(label, load_model(run["folder"] / "checkpoint.ckpt"))
    if not found:
        held = ", ".join(dict.fromkeys(str(run["train"]) for run in runs))
        raise UserError(f"No run was trained on {train!r}: there are {held}.")
    return found


def _rows(table: pd.DataFrame, state: Sequence[float] | None, train: str) -> np.ndarray:
    """Positions of the rows of the state asked for, or of a middling one."""
    if state is None:
        own = rows_of_set(table, train)
        picked = pick_states(own)
        if not picked:
            raise UserError(f"No kinematic state of {train} has usable rows to draw.")
        place: np.ndarray = own.index.to_numpy()[picked[len(picked) // 2]]
        return place
    where = places(table)
    of_sample = where[where["sample"] == state[0]]
    if not len(of_sample):
        raise UserError(f"The data hold no sample {state[0]:g}.")
    apart = np.ptp(of_sample["elongation_mm"]) or 1.0, np.ptp(of_sample["twist_deg"]) or 1.0
    distance = ((of_sample["elongation_mm"] - state[1]) / apart[0]) ** 2
    distance += ((of_sample["twist_deg"] - state[2]) / apart[1]) ** 2
    return np.flatnonzero(kinematic_state(table) == distance.idxmin())


def parameters(runs: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """One row per run and physical parameter: model, train, seed, parameter, value, stderr, unit."""
    rows = [
        [
            " + ".join([run["model"], *run["effects"]]),
            run["train"],
            run["seed"],
            name,
            p["value"],
            p["stderr"],
            p["unit"],
        ]
        for run in runs
        for name, p in run["parameters"].items()
        if p["unit"] and run["fit"] != "none"
    ]
    return pd.DataFrame(rows, columns=["model", "train", "seed", "parameter", "value", "stderr", "unit"])


def spread(fitted: pd.DataFrame) -> pd.DataFrame:
    """How far each parameter moves between runs: least, median and largest value, and the largest over the least."""
    found = fitted.groupby(["model", "parameter", "unit"], sort=False)["value"].agg(["min", "median", "max", "size"])
    found["max / min"] = (found["max"] / found["min"]).where(found["min"] > 0)
    return found.rename(columns={"size": "fits"}).reset_index()


def _write(table: pd.DataFrame, path: Path) -> None:
    write_whole(path, lambda p: table.to_csv(p, index=False, float_format="%.8g"))


def _shown(table: pd.DataFrame, title: str) -> Table:
    if "unit" in table:
        table = table.assign(parameter=table["parameter"] + " [" + table["unit"] + "]").drop(columns="unit")
    return rich_table(DisplayTable.from_frame(table, title))


def main() -> None:
    parser = argparse.ArgumentParser(
        prog=" ".join(program("figures", ["python", "-m", "freelearn.figures"])),
        description="Draw a sweep's (or a run's) admissible data, load vectors over the kinematic plane and load "
        "curves of all its models at one kinematic state; tables of the designs and of the fitted parameters.",
    )
    parser.add_argument("folder", type=Path, help="a sweep's folder, whose subfolders are its jobs, or a run's folder")
    parser.add_argument("--out", type=Path, help="where to write (default: FOLDER/figures)")
    parser.add_argument("--train", default="", help="training set whose models are drawn (default: the first one)")
    parser.add_argument(
        "--state", type=float, nargs=3, metavar=("SAMPLE", "ELONGATION_MM", "TWIST_DEG"),
        help="kinematic state of the load curves, the nearest one measured (default: a middling one)",
    )  # fmt: skip
    chosen = parser.parse_args()
    try:
        draw_folder(chosen.folder, chosen.out or chosen.folder / "figures", chosen.train, chosen.state, Console())
    except UserError as mistake:
        sys.exit(f"error: {mistake}")
