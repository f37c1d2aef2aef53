"""python -m freelearn.specimens UT=FILE ET=FILE PS=FILE --effects wall_stiffening: fit the rubber to its own tests."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import pandas as pd
from rich.console import Console

from freelearn.api.tasks.specimens_task import NEO_HOOKEAN, compared_specimens, fitted_specimens
from freelearn.cli.command_line import exit_on_user_error, program
from freelearn.common.files import write_whole
from freelearn.data.specimen_schema import mode_name
from freelearn.data.specimen_table import Specimens, read_specimens
from freelearn.records.run_files import check_folder
from freelearn.records.specimen_record import write_result
from freelearn.report.tables.specimen_tables import (
    combination_table,
    curve_table,
    mode_table,
    rubber_notes,
    rubber_parameters,
)
from freelearn.report.terminal.printed_tables import rich_table


def fit_specimens(
    data: Specimens,
    effects: Sequence[str],
    held_out: Sequence[str],
    out: Path,
    console: Console,
    compared: tuple[pd.DataFrame, str] | None = None,
) -> None:
    """Fits, writes specimen.json, curves.png, curves.csv and report.html to `out`, and prints a short table. Raises
    UserError."""
    check_folder(out)
    fit, alone = fitted_specimens(data, effects, held_out)
    write_result(out / "specimen.json", fit, data.files)
    # matplotlib costs a second to import: only here.
    from freelearn.report.plots.canvas import save
    from freelearn.report.plots.specimen_plot import specimen_curves

    fits = {NEO_HOOKEAN: alone} | ({f"with {' + '.join(effects)}": fit} if effects else {})
    curves = curve_table(data.table, fits)
    save(specimen_curves(curves, fits), curves, out / "curves.png")
    from freelearn.report.html.specimen_report import report_specimen

    notes = [*rubber_notes(fit, alone), *data.warnings]
    report_specimen(out / "report.html", fits, curves, notes, compared, out / "specimen.json")
    shown = {NEO_HOOKEAN: alone} | ({"with effects": fit} if effects else {})
    console.print(rich_table(mode_table(shown)))
    console.print(rich_table(rubber_parameters(fit)))
    for note in notes:
        console.print(f"! {note}", markup=False, highlight=False)
    console.print(f"report: {out / 'report.html'}", markup=False, highlight=False, soft_wrap=True)


def compare_specimens(data: Specimens, out: Path, console: Console, best: bool = False) -> None:
    """Prints the comparison of all combinations of effects and writes comparison.csv to `out`. best: goes on to fit
    what the tests ask for. Raises UserError."""
    check_folder(out)
    compared, said, effects = compared_specimens(data)
    write_whole(out / "comparison.csv", lambda p: compared.to_csv(p, index=False, float_format="%.6g"))
    console.print(rich_table(combination_table(compared)))
    console.print(said, markup=False, highlight=False)
    if best:
        fit_specimens(data, effects, (), out, console, (compared, said))
        return
    for warning in data.warnings:
        console.print(f"! {warning}", markup=False, highlight=False)
    console.print(f"table: {out / 'comparison.csv'}", markup=False, highlight=False, soft_wrap=True)


def _mode(text: str) -> str:
    name = mode_name(text)
    if name is None:
        raise argparse.ArgumentTypeError(f"unknown mode {text!r}: write UT, ET, PS or BT")
    return name


def main() -> None:
    """Runs the command on the words after its name."""
    parser = argparse.ArgumentParser(
        prog=" ".join(program("specimens", ["python", "-m", "freelearn.specimens"])),
        description="Fit the rubber's strain energy to tests of rubber alone: uniaxial (UT), equibiaxial (ET), pure "
        "shear (PS), both stretches imposed (BT). Writes specimen.json, whose parameters the continuum model can take "
        "over, and curves.png.",
    )
    parser.add_argument(
        "table",
        nargs="+",
        help="UT=FILE, ET=FILE, PS=FILE (CSV: stretch, stress_mpa), BT=FILE (with stretch_2, stress_2_mpa), "
        "or FILE with mode",
    )
    parser.add_argument(
        "--effects", nargs="*", default=[], metavar="NAME", help="energy effects besides the neo-Hookean"
    )
    parser.add_argument("--held-out", nargs="*", default=[], type=_mode, metavar="MODE", help="modes to predict only")
    parser.add_argument("--compare", action="store_true", help="compare all combinations of effects instead")
    parser.add_argument("--best", action="store_true", help="compare them, then fit what the tests ask for")
    parser.add_argument("--out", type=Path, help="folder to write to (default: under outputs/specimens)")
    arguments = parser.parse_args()
    compares = arguments.compare or arguments.best
    if compares and (arguments.effects or arguments.held_out):
        parser.error("--compare and --best try all effects and hold out each mode: drop --effects and --held-out")
    out = arguments.out or Path("outputs/specimens") / datetime.now().strftime("%Y-%m-%d/%H-%M-%S-%f")
    with exit_on_user_error("interrupted before there was a result.", out):
        data = read_specimens(arguments.table)
        if compares:
            compare_specimens(data, out, Console(), arguments.best)
        else:
            fit_specimens(data, arguments.effects, arguments.held_out, out, Console())
