"""`intake`: a laboratory's raw file becomes a measurement table, or a recipe to edit."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from rich.console import Console

from freelearn.api.settings.settings import IntakeSettings
from freelearn.api.tasks.intake_task import PROVENANCE, TakenIn, beside, taken_in
from freelearn.api.tasks.rubber_intake import is_rubber_recipe, rubber_taken_in
from freelearn.cli.command_line import ESTIMATED, command_line, option, program
from freelearn.common.files import read_bytes, remove_unfinished, write_text
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.joined import guess_file
from freelearn.data.intake.guesses.side_by_side import of_files
from freelearn.data.intake.readers.raw_files import is_folder, table_files
from freelearn.data.intake.rubber.rubber_guess import guess_tests, looks_like_rubber
from freelearn.data.intake.rubber.rubber_questions import rubber_draft
from freelearn.report.terminal.printed_intake import show_draft, show_guess, show_intake, show_rubber, show_tests
from freelearn.report.terminal.printed_tables import print_line, print_words


def take_in(settings: IntakeSettings, folder: Path, console: Console) -> None:
    """Writes the table and its provenance, or without a recipe the draft of one to `folder`. Raises UserError."""
    if settings.recipe is None:
        _draft(settings, folder, console)
    else:
        _table(settings, settings.recipe, folder, console)


def _draft(settings: IntakeSettings, folder: Path, console: Console) -> None:
    data = settings.data.path
    files = table_files(data) if is_folder(data) else []
    laid = of_files([data / name for name in files], data)
    found, joined = (laid[0], None) if laid else guess_file(data / files[0] if files else data, settings.design)
    path = folder / f"{stem_of(data)}_recipe.yaml"
    folder.mkdir(parents=True, exist_ok=True)
    remove_unfinished(folder)
    if looks_like_rubber(found):
        _draft_rubber(data, files, path, console)
        return
    write_text(path, draft(found, files, joined))
    words = [option("data.path", data), option("recipe", path)]
    # What was asked for this time is asked for the next time, too.
    words += [option(name, value) for name in ("out", "design") if (value := getattr(settings, name)) is not None]
    words += _chosen_folder()
    command = _command([*program("intake"), *words])
    show_guess(console, found, path, command)
    if looks_like_rubber(found) is None and not files:
        start = command_line(program("start", ["python", "-m", "freelearn", "start"]), [str(data)])
        print_words(console, "If it is a test of rubber alone:")
        print_line(console, f"  {start}")


def _draft_rubber(data: Path, files: Sequence[str], path: Path, console: Console) -> None:
    """The draft of a recipe of tests of rubber."""
    paths = [data / name for name in files] or [data]
    tests = guess_tests({one.name: read_bytes(one) for one in paths})
    write_text(path, rubber_draft(tests, {}, data.name))
    show_tests(console, tests)
    words = [option("data.path", data), option("recipe", path), *_chosen_folder()]
    show_draft(console, path, _command([*program("intake"), *words]))


def _chosen_folder() -> list[str]:
    """Where this run was told to write to, as it was said; nothing where nobody did."""
    said = HydraConfig.get().overrides.hydra if HydraConfig.initialized() else []
    return [word for word in said if word.startswith("hydra.run.dir=")]


def _table(settings: IntakeSettings, recipe_path: Path, folder: Path, console: Console) -> None:
    data = settings.data.path
    if is_rubber_recipe(recipe_path):
        rubber = rubber_taken_in([data], recipe_path, settings.out or folder / f"{stem_of(data)}_table.csv")
        files = [rubber.path, beside(rubber.path, PROVENANCE)]
        show_rubber(console, rubber.intake, files, specimens_command(rubber.path))
        return
    made = taken_in(data, recipe_path, settings.out or folder / f"{stem_of(data)}_table.csv", settings.design)
    members = [] if made.members is None else [made.members]
    files = [made.path, *members, beside(made.path, PROVENANCE)]
    following = [_command([*program(name), "train=all", *table_options(made)]) for name in ("train", "discover")]
    show_intake(console, made.intake, files, following)


def specimens_command(table: Path) -> str:
    """The command that fits a table of tests of rubber."""
    return command_line(program("specimens", ["python", "-m", "freelearn.specimens"]), [str(table), "--best"])


def stem_of(data: Path) -> str:
    """The name that a file, or a folder such as ., gives to what is made of it."""
    return Path(os.path.abspath(data)).stem


def table_options(made: TakenIn) -> list[str]:
    """The words by which a command takes the table that was made."""
    table = ["data=csv", option("data.path", made.path)]
    table += [f"data.bed={made.bed}"] if made.bed != "kinematic" else []
    table += [option("data.members", made.members)] if made.members is not None else []
    # Nobody has said how well this bed measures: the defaults are those of another one.
    return [*table, ESTIMATED]


def _command(words: Sequence[str]) -> str:
    return command_line([], words).strip()
