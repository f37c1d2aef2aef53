"""python -m freelearn.figures FOLDER: the paper's other figures and tables from a sweep's or a run's folder."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console

from freelearn.api.fitted_run import FittedRun
from freelearn.cli.command_line import exit_on_user_error, program
from freelearn.common.display import DisplayTable
from freelearn.common.errors import UserError
from freelearn.common.files import write_whole
from freelearn.data.beds import FORCE, MOMENT, bed_of
from freelearn.data.sets import rows_of_set
from freelearn.data.states import kinematic_state
from freelearn.queries.curves.curve_panels import curve_numbers
from freelearn.queries.curves.curve_rows import curves_of, measured_quantities, plane, pressures
from freelearn.queries.curves.model_curves import state_curves
from freelearn.queries.curves.shown_states import pick_states, places, state_title
from freelearn.queries.fitted_model import FittedModel
from freelearn.records.run_files import check_folder
from freelearn.records.sweep_records import RunRecord, read_records
from freelearn.report.plots.canvas import save
from freelearn.report.plots.curve_plots import curves
from freelearn.report.plots.simple_plots import admissible, load_vectors
from freelearn.report.tables.picture_numbers import admissible_table, load_vector_table
from freelearn.report.tables.sweep_tables import design_table, fitted_parameters, parameter_spread
from freelearn.report.terminal.printed_tables import FittedTable, print_line, rich_table


def draw_folder(
    folder: Path, out: Path, train: str, state: Sequence[float] | None, console: Console, banded: bool = True
) -> None:
    """Writes admissible, load_vectors (of single actuators with both loads) and curves (.png and .csv), designs.csv and
    parameters.csv; prints the tables.

    folder: of a sweep or a run. train: the training set whose models are drawn, "" for the first one. state: sample,
    elongation [mm] and twist [deg], or the loads [N, N·mm] under a dead load, None for the middling one. banded: the
    curves with the 95 % bands of those models that the state's sample was compared with. Raises UserError.
    """
    records = _records(folder)
    check_folder(out)
    table = pd.read_csv(records[0].folder / "predictions.csv")
    simulated = records[0].provenance.simulated
    drawn = ["admissible", "curves"]
    save(admissible(table, simulated), admissible_table(table, plane(table)), out / "admissible.png")
    # An end block has several pressures, none of which is the highest.
    if measured_quantities(table) == (FORCE, MOMENT) and len(pressures(table)) == 1:
        save(load_vectors(table, simulated), load_vector_table(table), out / "load_vectors.png")
        drawn.insert(1, "load_vectors")
    train = train or records[0].train
    fitted = _models(records, train)
    rows = _rows(table, state, train)
    models = {name: each.model for name, each in fitted.items()}
    bands = {name: each.bands for name, each in fitted.items()} if banded else {}
    ((measured, lines),) = state_curves(models, table, [rows], bands=bands)
    title = f"fitted on {train}: {state_title(measured)}"
    save(curves(measured, lines, title, simulated), curve_numbers(measured, lines), out / "curves.png")

    designs = design_table(table)
    _write(designs, out / "designs.csv")
    console.print(_shown(designs, "designs"))
    parameters = fitted_parameters(records)
    _write(parameters, out / "parameters.csv")
    if len(parameters):
        console.print(_shown(parameters, "fitted parameters"))
        moved = parameter_spread(parameters)
        console.print(_shown(moved, "how far they move between training sets"))
        _write(moved, out / "spread.csv")
    for name in drawn:
        print_line(console, f"picture: {out / name}.png")


def _records(folder: Path) -> list[RunRecord]:
    """The runs in the folder, about one table."""
    records = read_records(folder)
    if len({record.provenance.sha256 or record.provenance.seed for record in records}) > 1:
        raise UserError(
            f"The runs in {folder} are about different data: name one run's folder, or a sweep over one table."
        )
    return records


def _models(records: Sequence[RunRecord], train: str) -> dict[str, FittedModel]:
    """One model per label that was fitted on the training set."""
    models: dict[str, FittedModel] = {}
    for record in records:
        if record.train == train and record.title not in models:
            models[record.title] = FittedRun.from_folder(record.folder)
    if not models:
        there = ", ".join(dict.fromkeys(record.train for record in records))
        raise UserError(f"No run was trained on {train!r}: there are {there}.")
    return models


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
    columns = [quantity.column for quantity in bed_of(table).state]
    distance = sum(
        ((of_sample[name] - wanted) / (np.ptp(of_sample[name]) or 1.0)) ** 2
        for name, wanted in zip(columns, state[1:], strict=True)
    )
    visits = kinematic_state(table)
    # Of an end block's curves there the one with the most rows.
    curve = np.where(visits == distance.idxmin(), curves_of(table, visits), -1)
    return np.flatnonzero(curve == np.bincount(curve[curve >= 0]).argmax())


def _write(table: pd.DataFrame, path: Path) -> None:
    write_whole(path, lambda p: table.to_csv(p, index=False, float_format="%.8g"))


def _shown(table: pd.DataFrame, title: str) -> FittedTable:
    if "unit" in table:
        table = table.assign(parameter=table["parameter"] + " [" + table["unit"] + "]").drop(columns="unit")
    return rich_table(DisplayTable.from_frame(table, title))


def main() -> None:
    """Runs the command on the words after its name."""
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
        help="kinematic state of the curves, the nearest one measured; under a dead load its force [N] and moment "
        "[N·mm] in place of the last two (default: a middling one)",
    )  # fmt: skip
    parser.add_argument("--no-bands", action="store_true", help="curves without their 95 %% bands")
    chosen = parser.parse_args()
    out = chosen.out or chosen.folder / "figures"
    with exit_on_user_error("interrupted before all was drawn.", out):
        draw_folder(chosen.folder, out, chosen.train, chosen.state, Console(), not chosen.no_bands)
