"""`start`: from a raw file to the report. What the file does not say is asked for, and kept as a recipe."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from rich.console import Console

from freelearn.api.tasks.intake import TakenIn, taken_in
from freelearn.commands.command_line import command_line, program
from freelearn.commands.ending import one_sentence
from freelearn.commands.intake import option, stem_of, table_options
from freelearn.commands.interview import Ask, Interview
from freelearn.errors import UserError
from freelearn.files import write_text
from freelearn.measurements.intake.joined import guess_and_table
from freelearn.measurements.intake.sources import is_folder
from freelearn.render.terminal.intake import show_columns, show_intake


def main() -> None:
    """`start`, from the words of the command line."""
    parser = argparse.ArgumentParser(
        prog="freelearn start",
        description="Asks what a laboratory's file does not say, keeps the answers as a recipe, makes the table, and "
        "searches for the physics that a model of it misses. Ends with a report.",
    )
    parser.add_argument("raw", type=Path, help="the file: text, Excel, OpenDocument, MATLAB, HDF5, Parquet")
    parser.add_argument("--design", type=Path, help="designs of several actuators, a file with a row for each")
    parser.add_argument("--recipe", type=Path, help="of an earlier start: nothing is asked again")
    parser.add_argument("--out", type=Path, help="folder for all that is made; by default outputs/start/DAY/TIME")
    parser.add_argument("options", nargs="*", help="for the search, name=value (freelearn discover --help)")
    asked = parser.parse_intermixed_args()
    now = datetime.now()
    folder = asked.out or Path("outputs", "start", f"{now:%Y-%m-%d}", f"{now:%H-%M-%S-%f}")
    with one_sentence("interrupted; no table was written."):
        words = start(asked.raw, folder, Console(), input, asked.design, asked.recipe)
    # The search is a command of its own, with its settings, its report and its way of going on after an interruption.
    sys.argv = ["freelearn discover", *words, *asked.options, option("hydra.run.dir", folder)]
    from freelearn.commands.app import discover_app

    discover_app()


def start(
    raw: Path, folder: Path, console: Console, ask: Ask, design: Path | None = None, recipe: Path | None = None
) -> Sequence[str]:
    """Writes recipe, table and provenance to `folder`; gives the words of the search. Raises UserError."""
    if is_folder(raw):
        raise UserError(f"{raw} is a folder: start takes one file; for several, draft a recipe with intake.")
    table = folder / f"{stem_of(raw)}_table.csv"
    if recipe is not None:
        made = taken_in(raw, recipe, table, design)
    else:
        recipe = folder / f"{stem_of(raw)}_recipe.yaml"
        made = _asked(raw, recipe, table, console, ask, design)
        console.print(
            f"again without questions: {_again(raw, recipe, design)}", markup=False, highlight=False, soft_wrap=True
        )
    words = ["train=all", *table_options(made)]
    files = [made.path, recipe, *([made.members] if made.members else [])]
    show_intake(console, made.intake, files, [command_line(program("discover"), words)], going_on=True)
    return words


def _again(raw: Path, recipe: Path, design: Path | None) -> str:
    """The command that asks nothing."""
    words = [str(raw), "--recipe", str(recipe), *(["--design", str(design)] if design else [])]
    return command_line(program("start", ["python", "-m", "freelearn", "start"]), words)


def _keep(interview: Interview, recipe: Path) -> None:
    recipe.parent.mkdir(parents=True, exist_ok=True)
    write_text(recipe, interview.recipe())


def _broken_off(interview: Interview, ended: BaseException, raw: Path, recipe: Path, design: Path | None) -> str:
    """What to say where nobody answers any more; what was answered is kept."""
    if interview.answers:
        _keep(interview, recipe)
        return f"broken off. The answers are kept in {recipe}: fill in its TODOs, then: {_again(raw, recipe, design)}"
    if isinstance(ended, KeyboardInterrupt):
        return "interrupted; nothing was written."
    draft = command_line(program("intake"), [option("data.path", raw)])
    return f"start asks, and nobody answers: run it in a terminal, or draft a recipe to edit with {draft}"


def _asked(raw: Path, recipe: Path, table: Path, console: Console, ask: Ask, design: Path | None) -> TakenIn:
    """The table by the recipe that the answers make, once whoever answers is content with it."""

    def tell(sentence: str) -> None:
        console.print(f"  {sentence}", markup=False, highlight=False)

    found, joined, cells = guess_and_table(raw, design)
    show_columns(console, found)
    interview = Interview(found, joined, cells, ask, tell)
    try:
        interview.columns()
        interview.run()
    except (EOFError, KeyboardInterrupt) as ended:
        raise UserError(_broken_off(interview, ended, raw, recipe, design)) from None
    while True:
        _keep(interview, recipe)
        try:
            made = taken_in(raw, recipe, table, design)
        except UserError as mistake:
            tell(f"This makes no table: {mistake}")
            if not interview.change():
                raise
            continue
        doubtful = [warning for warning in made.intake.warnings if not warning.startswith(f"{raw.name}: ")]
        for warning in doubtful:
            tell(f"! {warning}")
        if not doubtful or not interview.change():
            # What has been said need not be said again.
            return replace(made, intake=replace(made.intake, warnings=()))
