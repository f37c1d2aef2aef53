"""`start`: from a raw file to the report. What the file does not say is asked for, and kept as a recipe."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from rich.console import Console

from freelearn.api.tasks.intake import taken_in
from freelearn.commands.command_line import command_line, program
from freelearn.commands.ending import one_sentence
from freelearn.commands.intake import option, stem_of, table_options
from freelearn.errors import UserError
from freelearn.files import write_text
from freelearn.measurements.intake.draft import draft
from freelearn.measurements.intake.joined import guess_file
from freelearn.measurements.intake.questions import Ask, Asking, answered
from freelearn.measurements.intake.sources import is_folder
from freelearn.render.terminal.intake import show_guess, show_intake


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
    if recipe is None:
        found, joined = guess_file(raw, design)
        recipe = folder / f"{stem_of(raw)}_recipe.yaml"
        words = [str(raw), "--recipe", str(recipe), *(["--design", str(design)] if design else [])]
        again = command_line(program("start", ["python", "-m", "freelearn", "start"]), words)
        show_guess(console, found, recipe, again, asks=True)

        def tell(sentence: str) -> None:
            console.print(f"  {sentence}", markup=False, highlight=False)

        try:
            text = answered(draft(found, (), joined), found, Asking(ask, tell))
        except EOFError:
            raise UserError(
                "start asks, and nobody answers: run it in a terminal, or draft a recipe to edit with "
                f"{command_line(program('intake'), [option('data.path', raw)])}"
            ) from None
        folder.mkdir(parents=True, exist_ok=True)
        write_text(recipe, text)
    made = taken_in(raw, recipe, folder / f"{stem_of(raw)}_table.csv", design)
    words = ["train=all", *table_options(made)]
    files = [made.path, recipe, *([made.members] if made.members else [])]
    show_intake(console, made.intake, files, [command_line(program("discover"), words)])
    return words
