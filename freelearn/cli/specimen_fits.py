"""python -m freelearn.specimens UT=FILE ET=FILE PS=FILE --effects wall_stiffening: fit the rubber to its own tests."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import pandas as pd
from rich.console import Console

from freelearn.api.tasks.specimens_task import (
    NEO_HOOKEAN,
    POWER,
    compared_specimens,
    fitted_specimens,
    has_recordings,
    relaxations,
    wanted_relaxation,
)
from freelearn.cli.command_line import command_line, exit_on_user_error, option, program
from freelearn.common.display import DisplayTable
from freelearn.common.files import write_whole
from freelearn.data.specimen_schema import mode_name
from freelearn.data.specimen_table import Specimens, read_specimens
from freelearn.physics.models.relaxation import Relaxation
from freelearn.records.run_files import check_folder
from freelearn.records.specimen_record import write_result
from freelearn.report.tables.specimen_tables import (
    combination_table,
    curve_table,
    mode_table,
    rubber_notes,
    rubber_parameters,
    time_table,
)
from freelearn.report.terminal.printed_tables import print_line, print_words, rich_table


@dataclass(frozen=True)
class Wanted:
    """Of recordings: relaxation, a number of arms or power, None for what they ask for; softened, or not."""

    relaxation: str | None = None
    softened: bool = False


def fit_specimens(
    data: Specimens,
    effects: Sequence[str],
    held_out: Sequence[str],
    out: Path,
    console: Console,
    compared: tuple[DisplayTable, str] | None = None,
    wanted: Wanted | None = None,
) -> None:
    """Fits, writes specimen.json, curves.png, curves.csv and report.html to `out`, and prints a short table. Raises
    UserError."""
    check_folder(out)
    relaxation, tried = _relaxation(data, effects, held_out, wanted or Wanted())
    if tried is not None:
        write_whole(out / "relaxations.csv", lambda p: tried.to_csv(p, index=False, float_format="%.6g"))
        console.print(rich_table(time_table(tried, "relaxation")))
    found = fitted_specimens(data, effects, held_out, relaxation)
    fit, alone = found.fit, found.alone
    write_result(out / "specimen.json", fit, data.files, found.apart)
    # matplotlib costs a second to import: only here.
    from freelearn.report.plots.canvas import save
    from freelearn.report.plots.specimen_plot import specimen_curves

    fits = {NEO_HOOKEAN: alone} | ({f"with {' + '.join(effects)}": fit} if effects else {})
    curves = curve_table(data.table, fits)
    save(specimen_curves(curves, fits), curves, out / "curves.png")
    from freelearn.report.html.specimen_report import report_specimen

    notes = [*rubber_notes(fit, alone), *data.warnings]
    tables = [mode_table(fits, found.apart), *([time_table(tried, "relaxation")] if tried is not None else [])]
    command = _taken_over(out / "specimen.json", effects)
    report_specimen(out / "report.html", fits, curves, notes, tables, compared, command)
    shown = {NEO_HOOKEAN: alone} | ({"with effects": fit} if effects else {})
    console.print(rich_table(mode_table(shown, found.apart)))
    if relaxation is not None:
        print_words(console, f"relaxation: {relaxation.words}")
    console.print(rich_table(rubber_parameters(fit)))
    for note in notes:
        print_words(console, f"! {note}")
    print_line(console, f"report: {out / 'report.html'}")


def _taken_over(result: Path, effects: Sequence[str]) -> str:
    """The command of an actuator of this rubber."""
    words = ["train=constituent", option("constituent", result)]
    return command_line(program("train"), [*words, *([f"effects=[{','.join(effects)}]"] if effects else [])])


def _relaxation(
    data: Specimens, effects: Sequence[str], held_out: Sequence[str], wanted: Wanted
) -> tuple[Relaxation | None, pd.DataFrame | None]:
    """The relaxation of the rubber, None where no test has a time, and those that were compared for it."""
    if wanted.relaxation is not None:
        return wanted_relaxation(data, wanted.relaxation, wanted.softened), None
    if not has_recordings(data):
        return None, None
    tried, relaxation = relaxations(data, effects, held_out)
    return relaxation, tried


def compare_specimens(
    data: Specimens, out: Path, console: Console, best: bool = False, wanted: Wanted | None = None
) -> None:
    """Prints the comparison of all combinations of effects and writes comparison.csv to `out`. best: goes on to fit
    what the tests ask for. Raises UserError."""
    check_folder(out)
    compared, said, effects = compared_specimens(data)
    write_whole(out / "comparison.csv", lambda p: compared.to_csv(p, index=False, float_format="%.6g"))
    table = time_table(compared, "effects") if has_recordings(data) else combination_table(compared)
    console.print(rich_table(table))
    print_words(console, said)
    if best:
        fit_specimens(data, effects, (), out, console, (table, said), wanted)
        return
    for warning in data.warnings:
        print_words(console, f"! {warning}")
    print_line(console, f"table: {out / 'comparison.csv'}")


def _test(text: str) -> str:
    """A mode's name, or a recording's as it is."""
    return mode_name(text) or text


def main() -> None:
    """Runs the command on the words after its name."""
    parser = argparse.ArgumentParser(
        prog=" ".join(program("specimens", ["python", "-m", "freelearn.specimens"])),
        description="Fit the rubber's strain energy to tests of rubber alone: uniaxial (UT), equibiaxial (ET), pure "
        "shear (PS), simple shear (SS), both stretches imposed (BT). A test with time_s is a recording, and shows how "
        "the rubber relaxes. Writes specimen.json, whose parameters the continuum model can take over, and curves.png.",
    )
    parser.add_argument(
        "table",
        nargs="+",
        help="UT=FILE, ET=FILE, PS=FILE (CSV: stretch, stress_mpa), SS=FILE (shear, stress_mpa), BT=FILE (with "
        "stretch_2, stress_2_mpa), or FILE with mode; recordings have time_s, too",
    )
    parser.add_argument(
        "--effects", nargs="*", default=[], metavar="NAME", help="energy effects besides the neo-Hookean"
    )
    parser.add_argument(
        "--held-out", nargs="*", default=[], type=_test, metavar="TEST", help="modes or recordings to predict only"
    )
    parser.add_argument(
        "--relaxation",
        choices=["1", "2", "3", POWER],
        help="of recordings: arms, or a power law (default: what predicts)",
    )
    parser.add_argument("--softened", action="store_true", help="arms that soften with strain, with --relaxation")
    parser.add_argument("--compare", action="store_true", help="compare all combinations of effects instead")
    parser.add_argument("--best", action="store_true", help="compare them, then fit what the tests ask for")
    parser.add_argument("--out", type=Path, help="folder to write to (default: under outputs/specimens)")
    arguments = parser.parse_args()
    compares = arguments.compare or arguments.best
    if compares and (arguments.effects or arguments.held_out):
        parser.error("--compare and --best try all effects and hold out each mode: drop --effects and --held-out")
    if arguments.softened and arguments.relaxation is None:
        parser.error("--softened says how a relaxation is: add --relaxation")
    wanted = Wanted(arguments.relaxation, arguments.softened)
    out = arguments.out or Path("outputs/specimens") / datetime.now().strftime("%Y-%m-%d/%H-%M-%S-%f")
    with exit_on_user_error("interrupted before there was a result.", out):
        data = read_specimens(arguments.table)
        if compares:
            compare_specimens(data, out, Console(), arguments.best, wanted)
        else:
            fit_specimens(data, arguments.effects, arguments.held_out, out, Console(), wanted=wanted)
